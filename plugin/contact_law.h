// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/* Contact forms say which vertex touches which edge. Restart files hold their numbers. */
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

/* Pair style circuloline takes the atoms of each type for one of these. */
enum Role {
  VERTEX,    // of a closed ring of bonds: a polygon
  WALL,      // of an open chain of bonds, or of a ring
  DISK,      // a point with a rim, whatever its bonds
  FLAT       // a line along x through one atom, which vertices alone meet
};

/* The contact of types i and j has the energy of PairLaw. These are arrays by type, so that fix
   adapt can change them. Widths and reaches may shrink during a run, but not grow beyond those at
   its start, for which the neighbor lists are made. */
struct ContactLaws {
  double **eps = nullptr, **width = nullptr;
  double **adhesion = nullptr, **range = nullptr;    // over the width
  double **initial_width = nullptr, **initial_reach = nullptr;
  int **form = nullptr;
  double longest_edge = 0.0;    // limit, so that neighbor lists hold an end of each edge
  double near = 0.0;    // range of a polygon's contacts with itself, for each edge between; 0: none
  std::vector<Role> role;

  bool disk(int type) const { return role[type] >= DISK; }    // or a line, without another end
  bool flat(int type) const { return role[type] == FLAT; }

  // distance up to which the law acts
  double reach(int i, int j) const { return width[i][j] * (1.0 + range[i][j]); }

  // whether types a and b have the same law with type k
  bool same(int a, int b, int k) const
  {
    return eps[a][k] == eps[b][k] && width[a][k] == width[b][k] && form[a][k] == form[b][k] &&
        adhesion[a][k] == adhesion[b][k] && range[a][k] == range[b][k];
  }

  /* Two atoms may be this far apart if their contact has its initial reach: an edge within reach of
     a point has one end no farther than half its length beyond the foot. */
  double cutoff(int i, int j) const
  {
    const double edge = disk(i) && disk(j) ? 0.0 : longest_edge;
    return std::hypot(initial_reach[i][j], 0.5 * edge);
  }

  /* A vertex and an edge of its own outline with m edges between repel up to the distance
     min(width, m near): an outline that bends little has no contacts with itself, however many
     vertices it has. From m = steps on, that is the width, of all types. None adheres to itself. */
  int steps = 1;
  int steps_of_range() const
  {
    double widest = 0.0;
    for (std::size_t i = 1; i < role.size(); i++)
      if (role[i] == VERTEX) widest = std::max(widest, initial_width[i][i]);
    return near > 0.0 ? std::max(1, static_cast<int>(std::ceil(widest / near))) : 1;
  }
};

/* With the overlap x = 1 - d/width at a distance d, the energy is E = (eps/2)(x^2 - adhesion range)
   down to x = -adhesion, and E = -(eps/2) falls (x + range)^2 from there to x = -range, where
   falls = adhesion/(range - adhesion). Without adhesion it ends at contact. Loops over contacts
   take the laws from one table, which is made anew for every evaluation. */
struct PairLaw {
  double eps, width, per_width, reachsq;    // square of the distance up to which contacts are found
  double adhesion = 0.0, range = 0.0, falls = 0.0;

  struct Push {
    double energy, force;    // minus the derivative of the energy by d
  };
  Push push(double d) const
  {
    const double overlap = 1.0 - d * per_width;
    if (overlap >= -adhesion || range == 0.0)
      return {0.5 * eps * (overlap * overlap - adhesion * range), eps * overlap * per_width};
    const double depth = overlap + range;
    return {-0.5 * eps * falls * depth * depth, -eps * falls * depth * per_width};
  }
  bool acts(double d) const { return 1.0 - d * per_width > -range; }
  // second derivative of the energy; beyond contact that of rims which a step brings there
  double stiffness(double d) const
  {
    const double overlap = 1.0 - d * per_width;
    if (overlap >= -adhesion || range == 0.0) return spring();
    return overlap > -range ? -falls * spring() : 0.0;
  }
  double spring() const { return eps * per_width * per_width; }    // of overlapping rims
};

class PairLaws {
 public:
  // special is 0, or for bonded disks the number of their factor in special_bonds, or special_of()
  static int number(int ntypes, int i, int j, int special)
  {
    return (special * (ntypes + 1) + i) * (ntypes + 1) + j;
  }

  // of a vertex and an edge of its own outline with this many edges between, at most laws.steps
  static int special_of(int between) { return SPECIAL - 1 + between; }

  // contacts are found up to a gap of `beyond`
  void set(const ContactLaws &laws, int ntypes, const double *special_factors, double beyond = 0.0)
  {
    const int rows = SPECIAL + (laws.near > 0.0 ? laws.steps : 0);
    table.resize(number(ntypes, 0, 0, rows));
    for (int special = 0; special < rows; special++)
      for (int i = 1; i <= ntypes; i++)
        for (int j = 1; j <= ntypes; j++) {
          const int between = special - SPECIAL + 1;
          const double eps = laws.eps[i][j] * (between > 0 ? 1.0 : special_factors[special]);
          const double range = between > 0 ? between * laws.near : HUGE_VAL;
          const double width = std::min(laws.width[i][j], range);
          const double reach = (between > 0 ? width : laws.reach(i, j)) + beyond;
          PairLaw &law = table[number(ntypes, i, j, special)];
          law = {eps, width, 1.0 / width, reach * reach};
          if (between > 0 || laws.range[i][j] == 0.0) continue;
          law.adhesion = laws.adhesion[i][j];
          law.range = laws.range[i][j];
          law.falls = law.adhesion / (law.range - law.adhesion);
        }
  }
  const PairLaw &operator[](int number) const { return table[number]; }

 private:
  static constexpr int SPECIAL = 4;    // none, 1-2, 1-3, 1-4
  std::vector<PairLaw> table;
};

}    // namespace LAMMPS_NS
