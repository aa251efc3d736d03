// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_PAIR_CIRCULOLINE_H
#define JAMLAB_PAIR_CIRCULOLINE_H

#include "pair.h"
#include "polygon_topology.h"

#include <vector>

namespace LAMMPS_NS {

/* Repulsion between the circulo-line outlines (width delta) of polygons.

   contact segment: Boromand et al. eq 8 to the letter. Every pair of edges of
     two polygons adds (eps/2)(1 - dmin/delta)^2, dmin = shortest distance
     between the two edges.
   contact outline: every vertex meets every other polygon once, at the closest
     point of its outline, with the same law. Smooth where eq 8 jumps between
     the ends of nearly parallel edges.

   Vertex i with its nearest facing edges, or edge i with one facing edge, is
   evaluated by the rank that owns i, with energy and virial in full; forces on
   ghosts go back by reverse communication whatever the newton setting. */

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
  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;
  void *extract(const char *, int &) override;
  double memory_usage() override;

 protected:
  enum Contact { SEGMENT, OUTLINE };

  double delta;           // width of the circulo-lines
  double longest_edge;    // edges may not outgrow this: it sets the neighbor cutoff
  Contact contact;
  double **eps;

  PolygonTopology topology;

  struct Edge {
    int tail, head;
  };
  struct Facing {    // one vertex (or edge) and the edges of one other polygon near it
    int i, j;        // the vertex; for SEGMENT the edge from i to j
    int begin, end;  // range in `edges`
  };
  std::vector<Facing> facings;
  std::vector<Edge> edges;
  std::vector<int> successor;    // local index of the next vertex of each atom, -1 if absent
  std::vector<double> ghost_force;

  void allocate();
  void find_facings();
  double edge_length(int, int) const;
  void check_edge_length(int, int) const;
  void outline(double *const *);
  void segment(double *const *);
  void apply(double *const *, int, int, Edge, double, double, double, double, double);
};

}    // namespace LAMMPS_NS

#endif
