// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_PAIR_CIRCULOLINE_H
#define JAMLAB_PAIR_CIRCULOLINE_H

#include "atom.h"
#include "contact_forms.h"
#include "pair.h"
#include "polygon_facings.h"

#include <vector>

namespace LAMMPS_NS {

/* Repulsion between the circulo-line outlines (width delta) of polygons, in one
   of the forms of contact_forms.h.

   A periodic image of a polygon is another polygon, also to itself. A contact is
   evaluated by the rank that owns its vertex (or edge), with energy and virial
   in full; forces on ghosts go back by reverse communication whatever the newton
   setting. */

class PairCirculoline : public Pair {
 public:
  PairCirculoline(class LAMMPS *);
  ~PairCirculoline() override;
  void compute(int, int) override;
  void settings(int, char **) override;
  void coeff(int, char **) override;
  void init_style() override;
  double init_one(int, int) override;
  void write_restart(FILE *) override;
  void read_restart(FILE *) override;
  void write_restart_settings(FILE *) override;
  void read_restart_settings(FILE *) override;
  void write_data(FILE *) override;
  void write_data_all(FILE *) override;
  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;
  void *extract(const char *, int &) override;
  double memory_usage() override;

  struct Push {    // of one contact: force on the vertex, the edge takes the opposite
    double distance, strength, overlap, fx, fy;
  };
  Push push_on_vertex(int vertex, PolygonFacings::Edge, const Foot &) const;
  double width() const { return delta; }

  // touch(owner, vertex, edge, foot) for the contacts of this rank, at present positions
  template <class Touch> void for_each_contact(Touch touch) const
  {
    refuse_stale_facings();
    LAMMPS_NS::for_each_contact(form, facings, atom->x, delta, touch);
  }

 protected:
  double delta;           // width of the circulo-lines
  double longest_edge;    // edges may not outgrow this: it sets the neighbor cutoff
  ContactForm form;
  double **eps;

  PolygonFacings facings;
  std::vector<double> ghost_force;

  void allocate();
  void find_facings();
  void refuse_stale_facings() const;
  void refuse_computes() const;
  template <bool TALLY> void push(double *const *);
};

}    // namespace LAMMPS_NS

#endif
