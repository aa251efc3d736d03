// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "atom.h"
#include "flat_walls.h"
#include "own_contacts.h"
#include "pair.h"

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

/* PairCirculoline is the repulsion and adhesion of outlines of a width: polygons (closed rings of
   bonds), walls (open chains) and disks, in the forms of contact_forms.h.

   A periodic image of a polygon is another polygon, also to itself. The rank that owns the vertex
   or disk evaluates its contacts. The three atoms of a contact share its energy and virial. Forces
   on ghosts go back by reverse communication whatever the newton setting. */
class PairCirculoline : public Pair {
 public:
  static constexpr char WHO[] = "Pair style circuloline";    // in messages

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

  struct ContactForce {    // of one contact: f acts on the vertex, and -f on the edge
    double gap, energy, magnitude;
    jamlab::Vector f;
  };
  ContactForce contact_force(const Contact &) const;
  const PairLaw &law_of(const Contact &contact) const { return pair_laws[contact.law]; }

  bool flat(int i) const { return laws.flat(atom->type[i]); }    // whether an atom is a flat wall
  // of a contact: the flat walls of several ranks have the numbers after atoms and ghosts
  struct End {
    tagint tag, molecule;
    int mask;
  };
  End end(int i) const;
  void refuse_shared_walls() const;    // where both ends of a contact must be atoms

  // Finds the contacts of this rank, where ghosts are up to date, with gaps up to `beyond`. The
  // list is valid until the next call. The second function is collective, and brings ghosts up to
  // date.
  const std::vector<Contact> &find_contacts(double beyond = 0.0);
  const std::vector<Contact> &present_contacts();

 protected:
  double delta;         // width of the outlines of types that pair_coeff gives none
  ContactForm form;     // and their contact form
  ContactLaws laws;
  PairLaws pair_laws;
  struct Given {           // by pair_coeff, for a pair of types
    double width = -1.0;   // -1: that of pair_style, or the mean of two types
    double mixed = -1.0;   // that mean, if it is in use
    int form = -1;         // ContactForm; -1: that of pair_style
  };
  struct Adhesion {
    double pull = 0.0, range = 0.0;
  };
  std::vector<Given> given_coeffs;
  Given &given(int i, int j) { return given_coeffs[i * (atom->ntypes + 1) + j]; }
  std::string role_types[FLAT + 1];    // as pair_style names them, before types are known
  bool in_use[NUMBER_OF_CONTACT_FORMS];

  class FixPolygonOutline *outline;
  std::vector<ContactCandidates> candidates;    // one for each contact form
  OwnContacts own_contacts;
  FlatWalls flat_walls;
  std::vector<Touch> found;    // of one block
  std::vector<Contact> all_found;
  enum { FORCE, ENERGY = 2, VIRIAL, RETURNED = 6 };
  using Returned = std::array<double, RETURNED>;    // to a ghost's owner, if LAMMPS does not
  std::vector<Returned> ghosts;

  std::vector<tagint> tags;                    // of atoms and ghosts when candidates were found
  std::pair<bigint, bigint> candidates_for;    // the neighbor lists of the candidates
  double layout = 0.0;                         // of the restart file that is read
  double user_cutoff, raised_cutoff;           // of ghosts, by comm_modify and by these contacts

  void allocate();
  void read_roles();
  void set(int, int, double eps, double width, int form, const Adhesion &);
  Adhesion read_adhesion(char **arg) const;
  void check_adhesion(int, int) const;
  std::string coefficients(int, int) const;    // as pair_coeff takes them
  void hold_initial(const char *name, double **initial, int i, int j, double value);
  void mix(int, int);
  void mix_widths(int, int);
  void find_candidates();
  void renew_candidates();
  void lower_ghost_cutoff();
  template <class Act> void visit_contacts(Act, double beyond = 0.0);
  template <bool OWN, bool TALLY> void apply_contacts();
  void tally(const Contact &, const ContactForce &, bool own);
  void return_from_ghosts();
};

}    // namespace LAMMPS_NS
