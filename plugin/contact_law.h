// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <cmath>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/* The contact forms: who meets whom. Their numbers stand in restart files. */
enum ContactForm { OUTLINE, SEGMENT_SMOOTH };

inline constexpr const char *CONTACT_FORMS[] = {"outline", "segment/smooth"};
inline constexpr int NUMBER_OF_CONTACT_FORMS = sizeof(CONTACT_FORMS) / sizeof(CONTACT_FORMS[0]);
static_assert(NUMBER_OF_CONTACT_FORMS == SEGMENT_SMOOTH + 1, "one name for each ContactForm");

inline std::string contact_form_names(const char *separator)
{
  std::string names;
  for (const char *name : CONTACT_FORMS)
    names += (names.empty() ? "" : separator) + std::string(name);
  return names;
}

/* What atoms of a type are to pair style circuloline. */
enum Role {
  VERTEX,    // of a closed ring of bonds: a polygon
  WALL,      // of an open chain of bonds, or of a ring
  DISK,      // a point with a rim, whatever its bonds
  FLAT       // a line along x through one atom, which vertices alone meet
};

/* The contact of types i and j: E = (eps/2)(1 - d/width)^2 of their distance d.
   Arrays by type, so that fix adapt can change them; widths may shrink during a
   run, not grow beyond `start`, for which the neighbor lists are made. */
struct ContactLaws {
  double **eps = nullptr, **width = nullptr, **start = nullptr;
  int **form = nullptr;
  double longest_edge = 0.0;    // limit, so that neighbor lists hold an end of each edge
  std::vector<Role> role;

  bool disk(int type) const { return role[type] >= DISK; }    // or a line, without another end
  bool flat(int type) const { return role[type] == FLAT; }

  /* how far apart two atoms may be whose contact has its width at the start of the run: an
     edge within reach of a point has one end no farther than half its length beyond the foot */
  double cutoff(int i, int j) const
  {
    const double edge = disk(i) && disk(j) ? 0.0 : longest_edge;
    return std::hypot(start[i][j], 0.5 * edge);
  }
};

/* The same for the loops over contacts: side by side, made anew for every evaluation. */
struct PairLaw {
  double eps, width, per_width, widthsq;
};

class PairLaws {
 public:
  // special: 0, or of bonded disks the number of their factor in special_bonds
  static int number(int ntypes, int i, int j, int special)
  {
    return (special * (ntypes + 1) + i) * (ntypes + 1) + j;
  }

  // beyond: width, at which contacts are still found
  void set(const ContactLaws &laws, int ntypes, const double *special_factors, double beyond = 0.0)
  {
    table.resize(number(ntypes, 0, 0, SPECIAL));
    for (int special = 0; special < SPECIAL; special++)
      for (int i = 1; i <= ntypes; i++)
        for (int j = 1; j <= ntypes; j++) {
          const double eps = special_factors[special] * laws.eps[i][j];
          const double width = laws.width[i][j], reach = width + beyond;
          table[number(ntypes, i, j, special)] = {eps, width, 1.0 / width, reach * reach};
        }
  }
  const PairLaw &operator[](int number) const { return table[number]; }

 private:
  static constexpr int SPECIAL = 4;    // none, 1-2, 1-3, 1-4
  std::vector<PairLaw> table;
};

}    // namespace LAMMPS_NS
