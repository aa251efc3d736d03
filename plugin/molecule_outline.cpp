// SPDX-License-Identifier: GPL-2.0-or-later
#include "molecule_outline.h"

#include <algorithm>

using namespace LAMMPS_NS;

namespace {

struct Bonded {    // atoms bonded to one atom: two at most on an outline
  int count = 0;
  int to[2] = {-1, -1};

  bool has(int k) const { return (count > 0 && to[0] == k) || (count > 1 && to[1] == k); }
  void add(int k)
  {
    if (has(k)) return;
    if (count < 2) to[count] = k;
    count++;
  }
  int other_than(int k) const { return to[0] == k ? to[1] : to[0]; }
};

int place_of(const std::vector<OutlineAtom> &atoms, tagint tag)
{
  const auto earlier = [](const OutlineAtom &atom, tagint t) { return atom.tag < t; };
  const auto found = std::lower_bound(atoms.begin(), atoms.end(), tag, earlier);
  return found == atoms.end() || found->tag != tag ? -1 : static_cast<int>(found - atoms.begin());
}

std::vector<Bonded> bonded_atoms(const std::vector<OutlineAtom> &atoms,
                                 const std::vector<OutlineBond> &bonds)
{
  std::vector<Bonded> bonded(atoms.size());
  for (const auto &bond : bonds) {
    const int a = place_of(atoms, bond.a), b = place_of(atoms, bond.b);
    if (a < 0 || b < 0 || a == b) continue;
    bonded[a].add(b);
    bonded[b].add(a);
  }
  return bonded;
}

/* Walks from an end of a chain to the other, or from the lowest ID of a ring around it. */
std::vector<int> walk(const std::vector<Bonded> &bonded, int start)
{
  std::vector<int> path = {start};
  int before = -1, here = start;
  while (true) {
    const int next = before < 0 ? bonded[here].to[0] : bonded[here].other_than(before);
    if (next < 0 || next == start) return path;
    path.push_back(next);
    before = here;
    here = next;
  }
}

double twice_area(const std::vector<OutlineAtom> &atoms, const std::vector<int> &ring)
{
  const jamlab::Vector origin = atoms[ring[0]].r;
  double sum = 0.0;
  for (std::size_t k = 0; k < ring.size(); k++)
    sum += cross(atoms[ring[k]].r - origin, atoms[ring[(k + 1) % ring.size()]].r - origin);
  return sum;
}

/* Counts pairs of edges of a closed polygon that pass through each other. */
int edge_crossings(const std::vector<jamlab::Vector> &r)
{
  const std::size_t size = r.size();
  int crossings = 0;
  for (std::size_t a = 0; a < size; a++)
    for (std::size_t b = a + 2; b < size; b++)
      crossings += edges_cross(r[a], r[(a + 1) % size], r[b], r[(b + 1) % size]);
  return crossings;
}

}    // namespace

std::vector<OutlineLink> LAMMPS_NS::outline_links(const std::vector<OutlineAtom> &atoms,
                                                  const std::vector<OutlineBond> &bonds)
{
  const int natoms = static_cast<int>(atoms.size());
  const std::vector<Bonded> bonded = bonded_atoms(atoms, bonds);
  std::vector<OutlineLink> links(natoms, {0, 0, LONE, 1, 0, 0});

  int in_bonds = 0, start = -1;
  bool branched = false, open = false;
  for (int k = 0; k < natoms; k++) {
    if (bonded[k].count == 0) continue;
    in_bonds++;
    branched = branched || bonded[k].count > 2;
    const bool end = bonded[k].count == 1;
    if (start < 0 || (end && !open)) start = k;
    open = open || end;
  }
  if (in_bonds == 0) return links;

  std::vector<int> path;
  if (!branched) path = walk(bonded, start);
  const int size = static_cast<int>(path.size());
  if (branched || size != in_bonds) {
    for (int k = 0; k < natoms; k++)
      if (bonded[k].count) links[k].kind = TANGLE;
    return links;
  }

  if (!open && twice_area(atoms, path) < 0.0) std::reverse(path.begin(), path.end());
  std::vector<jamlab::Vector> r;
  for (const int k : path) r.push_back(atoms[k].r);
  const int crossings = open ? 0 : edge_crossings(r);
  for (int n = 0; n < size; n++) {
    const tagint next = open && n == size - 1 ? 0 : atoms[path[(n + 1) % size]].tag;
    const tagint prev = open && n == 0 ? 0 : atoms[path[(n + size - 1) % size]].tag;
    links[path[n]] = {next, prev, open ? CHAIN : RING, size, 0, crossings, 0, n};
  }
  links[*std::min_element(path.begin(), path.end())].first = 1;
  return links;
}
