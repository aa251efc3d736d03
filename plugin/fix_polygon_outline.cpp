// SPDX-License-Identifier: GPL-2.0-or-later
#include "fix_polygon_outline.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "memory.h"
#include "modify.h"
#include "neighbor.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <tuple>

using namespace LAMMPS_NS;

static constexpr char ID[] = "POLYGON_OUTLINE";
static constexpr int PER_ATOM = (sizeof(OutlineLink) + 7) / 8;    // numbers of a link that travels
static constexpr int PER_GHOST = PER_ATOM + 2;

namespace {

struct Record {    // an atom of a molecule, or one of its bonds
  tagint molecule, tag, partner;    // partner 0: the atom itself
  int rank, index;                  // its owner, and its local index there
  double x[2];                      // in the box
  ImageOffset image;
};

struct ReturnedLink {
  int rank, index;
  OutlineLink link;
};

}    // namespace

/* Other styles make this fix by: fix ID all POLYGON/OUTLINE. Users do not need it. */
FixPolygonOutline::FixPolygonOutline(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), unread(true), rebuilds(0), refreshed(0),
    refreshed_for(-1, -1)
{
  if (narg != 3) error->all(FLERR, "Fix POLYGON/OUTLINE takes no arguments");
  if (domain->dimension != 2) error->all(FLERR, "Polygons require a 2d simulation");

  create_attribute = 1;
  maxexchange = PER_ATOM;
  comm_forward = PER_GHOST;
  FixPolygonOutline::grow_arrays(atom->nmax);
  for (int i = 0; i < atom->nlocal; i++) FixPolygonOutline::set_arrays(i);
  atom->add_callback(Atom::GROW);
}

FixPolygonOutline::~FixPolygonOutline()
{
  if (modify->get_fix_by_id(id)) atom->delete_callback(id, Atom::GROW);
}

/* All styles share one instance, which the first of them makes. */
FixPolygonOutline *FixPolygonOutline::shared(LAMMPS *lmp, const char *caller)
{
  Fix *const present = lmp->modify->get_fix_by_id(ID);
  if (auto *const made = dynamic_cast<FixPolygonOutline *>(present)) return made;
  const std::string who(caller);
  if (lmp->domain->dimension != 2) lmp->error->all(FLERR, who + " requires a 2d simulation");
  if (!lmp->atom->molecule_flag) lmp->error->all(FLERR, who + " requires atoms with molecule IDs");
  if (lmp->atom->molecular != Atom::MOLECULAR)
    lmp->error->all(FLERR, who + " takes outlines from the bonds of each atom: use atom_style "
                    "molecular, bond or full");
  if (lmp->atom->map_style == Atom::MAP_NONE)
    lmp->error->all(FLERR, who + " requires an atom map: use atom_modify map array");

  Fix *const made = lmp->modify->add_fix(fmt::format("{} all POLYGON/OUTLINE", ID));
  return dynamic_cast<FixPolygonOutline *>(made);
}

bigint FixPolygonOutline::refresh()
{
  const int nlocal = atom->nlocal, nall = nlocal + atom->nghost;
  if (!unread && refreshed_for == lists() && static_cast<int>(tags.size()) == nall &&
      std::equal(tags.begin(), tags.end(), atom->tag))
    return refreshed;

  int changed = unread || outlines_changed();
  MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, world);
  if (changed) {
    read_bonds();
    warn_of_crossings();    // here, once a run, not for every style that reads them in its init()
  }

  tags.assign(atom->tag, atom->tag + nall);
  images.resize(nall);
  for (int i = 0; i < nlocal; i++) images[i] = ImageOffset(atom->image[i]);
  comm->forward_comm(this);

  successor.resize(nall);
  predecessor.resize(nall);
  for (int i = 0; i < nall; i++) {
    successor[i] = in_same_image(i, links[i].next);
    predecessor[i] = in_same_image(i, links[i].prev);
  }
  refreshed_for = lists();
  return ++refreshed;
}

std::pair<bigint, bigint> FixPolygonOutline::lists() const
{
  return {rebuilds, neighbor->ncalls};
}

/* This number changes when atom i has other bonds than before. */
int FixPolygonOutline::bonds_of(int i) const
{
  unsigned sum = 0;
  for (int m = 0; m < atom->num_bond[i]; m++)
    if (atom->bond_type[i][m] > 0)
      sum += 2654435761u * static_cast<unsigned>(atom->bond_atom[i][m]) + 1u;
  return static_cast<int>(sum);
}

/* During a run atoms may come (fix deposit), lose a neighbor (fix evaporate) or get other bonds. */
bool FixPolygonOutline::outlines_changed() const
{
  for (int i = 0; i < atom->nlocal; i++) {
    const OutlineLink &own = links[i];
    if (own.kind == UNKNOWN || own.bonds != bonds_of(i) || (own.next && atom->map(own.next) < 0) ||
        (own.prev && atom->map(own.prev) < 0))
      return true;
  }
  return false;
}

int FixPolygonOutline::in_same_image(int i, tagint tag) const
{
  if (!tag) return -1;
  int j = atom->map(tag);
  while (j >= 0 && !(images[j] == images[i])) j = atom->sametag[j];
  return j;
}

/* Each rank makes the outlines of some molecules: the callback of Comm::rendezvous. The link of
   each atom returns to the owner of the atom. */
static int find_links(int count, char *buffer, int &kind, int *&owners, char *&out, void *caller)
{
  const auto lmp = static_cast<LAMMPS *>(caller);
  const auto records = reinterpret_cast<Record *>(buffer);
  std::sort(records, records + count, [](const Record &p, const Record &q) {
    const bool p_bond = p.partner, q_bond = q.partner;    // bonds follow the atoms of a molecule
    return std::tie(p.molecule, p_bond, p.tag) < std::tie(q.molecule, q_bond, q.tag);
  });
  std::vector<ReturnedLink> links;
  std::vector<OutlineAtom> atoms;
  std::vector<OutlineBond> bonds;
  for (int begin = 0, end = 0; begin < count; begin = end) {
    atoms.clear();
    bonds.clear();
    for (; end < count && records[end].molecule == records[begin].molecule; end++) {
      const Record &record = records[end];
      const ImageOffset image = record.image - records[begin].image;
      if (record.partner)
        bonds.push_back({record.tag, record.partner});
      else
        atoms.push_back({record.tag, image.unwrapped(record.x, lmp->domain)});
    }
    const auto found = outline_links(atoms, bonds);
    for (std::size_t k = 0; k < found.size(); k++)
      links.push_back({records[begin + k].rank, records[begin + k].index, found[k]});
  }
  kind = 2;    // what returns is another buffer
  lmp->memory->create(owners, links.size(), "polygon/outline:owners");
  for (std::size_t k = 0; k < links.size(); k++) owners[k] = links[k].rank;
  const std::size_t size = links.size() * sizeof(ReturnedLink);
  out = static_cast<char *>(lmp->memory->smalloc(size, "polygon/outline:links"));
  std::copy(links.begin(), links.end(), reinterpret_cast<ReturnedLink *>(out));
  return static_cast<int>(links.size());
}

/* One rank receives all bonds of a molecule. The map of LAMMPS may not know these atoms yet. */
std::vector<OutlineLink> FixPolygonOutline::present_links() const
{
  std::vector<OutlineLink> found(atom->nlocal);
  std::vector<Record> own;
  std::vector<int> ranks;
  for (int i = 0; i < atom->nlocal; i++) {
    const tagint molecule = atom->molecule[i], tag = atom->tag[i];
    found[i] = {0, 0, atom->num_bond[i] ? TANGLE : LONE, 1, 0, 0, bonds_of(i)};
    if (molecule <= 0) continue;    // no molecule
    const double *const x = atom->x[i];
    own.push_back({molecule, tag, 0, comm->me, i, {x[0], x[1]}, ImageOffset(atom->image[i])});
    for (int m = 0; m < atom->num_bond[i]; m++)
      if (atom->bond_type[i][m] > 0)
        own.push_back({molecule, tag, atom->bond_atom[i][m], comm->me, i, {}, {}});
    ranks.resize(own.size(), static_cast<int>(molecule % comm->nprocs));
  }
  char *buffer = nullptr;
  const int size = static_cast<int>(own.size());
  const int count = comm->rendezvous(1, size, reinterpret_cast<char *>(own.data()), sizeof(Record),
                                     0, ranks.data(), find_links, 0, buffer, sizeof(ReturnedLink),
                                     lmp);
  const auto returned = reinterpret_cast<const ReturnedLink *>(buffer);
  for (int k = 0; k < count; k++) {
    OutlineLink &link = found[returned[k].index];
    const int bonds = link.bonds;
    link = returned[k].link;
    link.bonds = bonds;
  }
  memory->sfree(buffer);
  return found;
}

void FixPolygonOutline::read_bonds()
{
  const std::vector<OutlineLink> found = present_links();
  std::copy(found.begin(), found.end(), links.begin());
  unread = false;
}

void FixPolygonOutline::warn_of_crossings() const
{
  int crossed = 0;
  tagint lowest = MAXTAGINT;
  for (int i = 0; i < atom->nlocal; i++)
    if (links[i].first && links[i].crossings) {
      crossed++;
      lowest = std::min(lowest, atom->molecule[i]);
    }
  MPI_Allreduce(MPI_IN_PLACE, &crossed, 1, MPI_INT, MPI_SUM, world);
  MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, world);
  if (crossed && comm->me == 0)
    error->warning(FLERR, "{} polygons cross their own outline, the first is molecule {}: which "
                   "side is inside is a guess; see the fourth column of compute polygon", crossed,
                   lowest);
}

int FixPolygonOutline::pack_exchange(int i, double *buf)
{
  std::memcpy(buf, &links[i], sizeof(OutlineLink));
  return PER_ATOM;
}

int FixPolygonOutline::unpack_exchange(int i, double *buf)
{
  std::memcpy(static_cast<void *>(&links[i]), buf, sizeof(OutlineLink));
  return PER_ATOM;
}

/* A ghost lies pbc lattice vectors from the atom that it is an image of. */
int FixPolygonOutline::pack_forward_comm(int n, int *list, double *buf, int /*pbc_flag*/, int *pbc)
{
  for (int k = 0; k < n; k++, buf += PER_GHOST) {
    pack_exchange(list[k], buf);
    buf[PER_ATOM] = images[list[k]].a - pbc[0];
    buf[PER_ATOM + 1] = images[list[k]].b - pbc[1];
  }
  return PER_GHOST * n;
}

void FixPolygonOutline::unpack_forward_comm(int n, int first, double *buf)
{
  for (int i = first; i < first + n; i++, buf += PER_GHOST) {
    unpack_exchange(i, buf);
    images[i] = {static_cast<int>(buf[PER_ATOM]), static_cast<int>(buf[PER_ATOM + 1])};
  }
}
