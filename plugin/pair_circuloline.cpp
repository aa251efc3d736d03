// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "pair_circuloline.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

using namespace LAMMPS_NS;

namespace {

// closest point of the edge tail-head to a vertex: distance vector to it and its place t in [0, 1]

struct Foot {
  double dx, dy, rsq, t;
};

inline Foot foot_on_edge(const double *vertex, const double *tail, const double *head)
{
  const double ex = head[0] - tail[0], ey = head[1] - tail[1];
  const double rx = vertex[0] - tail[0], ry = vertex[1] - tail[1];
  const double lsq = ex * ex + ey * ey;
  double t = lsq > 0.0 ? (rx * ex + ry * ey) / lsq : 0.0;
  t = std::min(1.0, std::max(0.0, t));
  const double dx = rx - t * ex, dy = ry - t * ey;
  return {dx, dy, dx * dx + dy * dy, t};
}

inline double cross(const double *o, const double *a, const double *b)
{
  return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

inline bool edges_cross(const double *a, const double *b, const double *c, const double *d)
{
  return cross(a, b, c) * cross(a, b, d) < 0.0 && cross(c, d, a) * cross(c, d, b) < 0.0;
}

}    // namespace

/* ---------------------------------------------------------------------- */

PairCirculoline::PairCirculoline(LAMMPS *lmp) : Pair(lmp), eps(nullptr), topology(lmp)
{
  single_enable = 0;    // a contact is more than two atoms
  restartinfo = 1;
  writedata = 1;
  manybody_flag = 1;
  no_virial_fdotr_compute = 1;    // the virial is summed contact by contact, newton on or off
  comm_reverse_off = 2;
  delta = longest_edge = 0.0;
  contact = OUTLINE;
}

/* ---------------------------------------------------------------------- */

PairCirculoline::~PairCirculoline()
{
  if (copymode) return;
  if (allocated) {
    memory->destroy(setflag);
    memory->destroy(cutsq);
    memory->destroy(eps);
  }
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);

  if (neighbor->ago == 0) find_facings();

  // LAMMPS clears and returns forces on ghosts only if a newton flag is on

  const bool own_buffer = !force->newton;
  std::vector<double *> rows;
  double *const *f = atom->f;
  if (own_buffer) {
    const int nall = atom->nlocal + atom->nghost;
    ghost_force.assign(2 * nall, 0.0);
    rows.resize(nall);
    for (int i = 0; i < nall; i++) rows[i] = &ghost_force[2 * i];
    f = rows.data();
  }

  if (contact == OUTLINE)
    outline(f);
  else
    segment(f);

  if (own_buffer) {
    comm->reverse_comm(this);
    for (int i = 0; i < atom->nlocal; i++) {
      atom->f[i][0] += f[i][0];
      atom->f[i][1] += f[i][1];
    }
  }
}

/* ----------------------------------------------------------------------
   every vertex against the one closest point of each facing polygon
------------------------------------------------------------------------- */

void PairCirculoline::outline(double *const *f)
{
  const double *const *x = atom->x;
  const int *type = atom->type;
  const double deltasq = delta * delta;

  for (const auto &facing : facings) {
    const double *vertex = x[facing.i];
    Foot nearest = {0.0, 0.0, deltasq, 0.0};
    int found = -1;
    for (int n = facing.begin; n < facing.end; n++) {
      const Foot foot = foot_on_edge(vertex, x[edges[n].tail], x[edges[n].head]);
      if (foot.rsq < nearest.rsq) {
        nearest = foot;
        found = n;
      }
    }
    if (found < 0) continue;

    const Edge &edge = edges[found];
    const double d = sqrt(nearest.rsq);
    const double overlap = 1.0 - d / delta;
    const double strength = eps[type[facing.i]][type[edge.tail]];
    const double magnitude = d > 0.0 ? strength * overlap / (delta * d) : 0.0;
    apply(f, facing.i, facing.i, edge, nearest.t, nearest.dx, nearest.dy, magnitude,
          0.5 * strength * overlap * overlap);
  }
}

/* ----------------------------------------------------------------------
   every edge against every facing edge at their smallest distance (eq 8):
   one of the four distances of an end to the other edge, 0 if they cross
------------------------------------------------------------------------- */

void PairCirculoline::segment(double *const *f)
{
  const double *const *x = atom->x;
  const int *type = atom->type;

  for (const auto &facing : facings) {
    const Edge a = {facing.i, facing.j};
    for (int n = facing.begin; n < facing.end; n++) {
      const Edge &b = edges[n];
      const struct {
        int vertex;
        Edge edge;
      } ends[4] = {{a.tail, b}, {a.head, b}, {b.tail, a}, {b.head, a}};

      Foot nearest = {0.0, 0.0, delta * delta, 0.0};
      int found = -1;
      for (int k = 0; k < 4; k++) {
        const Foot foot =
            foot_on_edge(x[ends[k].vertex], x[ends[k].edge.tail], x[ends[k].edge.head]);
        if (foot.rsq < nearest.rsq) {
          nearest = foot;
          found = k;
        }
      }

      const double strength = eps[type[a.tail]][type[b.tail]];
      if (edges_cross(x[a.tail], x[a.head], x[b.tail], x[b.head])) {
        apply(f, a.tail, a.tail, b, 0.0, 0.0, 0.0, 0.0, 0.5 * strength);
      } else if (found >= 0) {
        const double d = sqrt(nearest.rsq);
        const double overlap = 1.0 - d / delta;
        const double magnitude = d > 0.0 ? strength * overlap / (delta * d) : 0.0;
        apply(f, a.tail, ends[found].vertex, ends[found].edge, nearest.t, nearest.dx, nearest.dy,
              magnitude, 0.5 * strength * overlap * overlap);
      }
    }
  }
}

/* ----------------------------------------------------------------------
   push a vertex away from the point t of an edge; tally the contact once, on
   the atom that this rank owns
------------------------------------------------------------------------- */

inline void PairCirculoline::apply(double *const *f, int owner, int vertex, Edge edge, double t,
                                   double dx, double dy, double magnitude, double energy)
{
  const double fx = magnitude * dx, fy = magnitude * dy;
  f[vertex][0] += fx;
  f[vertex][1] += fy;
  f[edge.tail][0] -= (1.0 - t) * fx;
  f[edge.tail][1] -= (1.0 - t) * fy;
  f[edge.head][0] -= t * fx;
  f[edge.head][1] -= t * fy;

  if (!evflag) return;
  const double v[6] = {dx * fx, dy * fy, 0.0, dx * fy, 0.0, 0.0};
  if (eflag_global) eng_vdwl += energy;
  if (vflag_global)
    for (int k = 0; k < 6; k++) virial[k] += v[k];

  if (eflag_atom) eatom[owner] += energy;
  if (vflag_atom)
    for (int k = 0; k < 6; k++) vatom[owner][k] += v[k];
}

/* ----------------------------------------------------------------------
   after each neighbor build: which edges can come within delta of which
   vertex (or edge) before the next build. Ends move by less than half the
   skin, so nothing farther than delta + skin now can touch until then.
------------------------------------------------------------------------- */

void PairCirculoline::find_facings()
{
  const double *const *x = atom->x;
  const tagint *tag = atom->tag;
  const tagint *molecule = atom->molecule;
  const int nlocal = atom->nlocal;
  const int nall = nlocal + atom->nghost;
  const double reachsq = (delta + neighbor->skin) * (delta + neighbor->skin);

  facings.clear();
  edges.clear();
  successor.assign(nall, -2);    // -2: not looked up yet

  auto next = [&](int i) {
    if (successor[i] == -2) successor[i] = topology.next(i);
    return successor[i];
  };

  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    if (molecule[i] == 0) continue;
    const int inext = next(i);
    if (inext < 0)
      error->one(FLERR, "Pair style circuloline: vertex {} cannot see the next one, {}: raise "
                 "the longest edge of pair_style circuloline or comm_modify cutoff",
                 tag[i], topology.next_tag(tag[i], molecule[i]));
    check_edge_length(i, inext);

    const int begin_i = static_cast<int>(facings.size());
    const int *jlist = list->firstneigh[i];
    const int jnum = list->numneigh[i];

    for (int jj = 0; jj < jnum; jj++) {
      const int j = jlist[jj] & NEIGHMASK;
      if (molecule[j] == molecule[i] || molecule[j] == 0) continue;
      if (contact == SEGMENT && tag[j] < tag[i]) continue;    // the owner of the other edge has it
      const int jnext = next(j);
      // a head that is no ghost here (map finds none, or an image far away) is beyond reach; an edge
      // that really is too long is reported by the rank that owns its tail
      if (jnext < 0 || edge_length(j, jnext) > longest_edge) continue;

      double rsq = foot_on_edge(x[i], x[j], x[jnext]).rsq;
      if (contact == SEGMENT) {
        rsq = std::min({rsq, foot_on_edge(x[inext], x[j], x[jnext]).rsq,
                        foot_on_edge(x[j], x[i], x[inext]).rsq,
                        foot_on_edge(x[jnext], x[i], x[inext]).rsq});
      }
      const bool crossing =
          contact == SEGMENT && edges_cross(x[i], x[inext], x[j], x[jnext]);
      if (rsq >= reachsq && !crossing) continue;

      // one facing for all edges of one image of a polygon: `edges` of a facing are consecutive,
      // so an edge that belongs to an earlier facing of this vertex is inserted there

      int home = -1;
      if (contact == OUTLINE) {
        for (int k = begin_i; k < static_cast<int>(facings.size()); k++) {
          const int other = edges[facings[k].begin].tail;
          if (molecule[other] == molecule[j] && domain->closest_image(j, atom->map(tag[other])) == other)
            home = k;
        }
      }
      if (home < 0) {
        const int size = static_cast<int>(edges.size());
        facings.push_back({i, inext, size, size + 1});
        edges.push_back({j, jnext});
      } else {
        edges.insert(edges.begin() + facings[home].end, {j, jnext});
        facings[home].end++;
        for (int k = home + 1; k < static_cast<int>(facings.size()); k++) {
          facings[k].begin++;
          facings[k].end++;
        }
      }
    }
  }
}

/* ---------------------------------------------------------------------- */

double PairCirculoline::edge_length(int i, int j) const
{
  const double *const *x = atom->x;
  return std::hypot(x[i][0] - x[j][0], x[i][1] - x[j][1]);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::check_edge_length(int i, int j) const
{
  const double length = edge_length(i, j);
  if (length > longest_edge)
    error->one(FLERR, "Pair style circuloline: the edge between atoms {} and {} is {:.6g} long, "
               "more than the {:.6g} that pair_style circuloline allows: raise its second argument",
               atom->tag[i], atom->tag[j], length, longest_edge);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::allocate()
{
  allocated = 1;
  const int np1 = atom->ntypes + 1;

  memory->create(setflag, np1, np1, "pair:setflag");
  for (int i = 1; i < np1; i++)
    for (int j = i; j < np1; j++) setflag[i][j] = 0;

  memory->create(cutsq, np1, np1, "pair:cutsq");
  memory->create(eps, np1, np1, "pair:eps");
}

/* ----------------------------------------------------------------------
   pair_style circuloline delta longest_edge [contact outline|segment]
------------------------------------------------------------------------- */

void PairCirculoline::settings(int narg, char **arg)
{
  if (narg != 2 && narg != 4)
    error->all(FLERR, "Pair style circuloline needs: delta longest_edge [contact outline|segment]");

  delta = utils::numeric(FLERR, arg[0], false, lmp);
  longest_edge = utils::numeric(FLERR, arg[1], false, lmp);
  if (delta <= 0.0) error->all(FLERR, "Pair style circuloline: delta {} must be positive", arg[0]);
  if (longest_edge <= 0.0)
    error->all(FLERR, "Pair style circuloline: longest edge {} must be positive", arg[1]);

  contact = OUTLINE;
  if (narg == 4) {
    if (strcmp(arg[2], "contact") != 0)
      error->all(FLERR, "Pair style circuloline: unknown keyword {}, expected contact", arg[2]);
    if (strcmp(arg[3], "segment") == 0)
      contact = SEGMENT;
    else if (strcmp(arg[3], "outline") != 0)
      error->all(FLERR, "Pair style circuloline: unknown contact form {}, expected outline or segment",
                 arg[3]);
  }
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::coeff(int narg, char **arg)
{
  if (narg != 3) error->all(FLERR, "Pair style circuloline needs: pair_coeff i j eps");
  if (!allocated) allocate();

  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, atom->ntypes, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, atom->ntypes, jlo, jhi, error);
  const double eps_one = utils::numeric(FLERR, arg[2], false, lmp);
  if (eps_one < 0.0) error->all(FLERR, "Pair style circuloline: eps {} must not be negative", arg[2]);

  int count = 0;
  for (int i = ilo; i <= ihi; i++)
    for (int j = std::max(jlo, i); j <= jhi; j++) {
      eps[i][j] = eps[j][i] = eps_one;
      setflag[i][j] = 1;
      count++;
    }
  if (count == 0) error->all(FLERR, "Pair style circuloline: pair_coeff {} {} names no pair", arg[0], arg[1]);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::init_style()
{
  topology.build("Pair style circuloline");
  neighbor->add_request(this, NeighConst::REQ_FULL);
}

/* ----------------------------------------------------------------------
   an edge within reach of a vertex has its tail within delta + its length;
   two edges within reach have tails within delta + both lengths
------------------------------------------------------------------------- */

double PairCirculoline::init_one(int i, int j)
{
  if (setflag[i][j] == 0)
    error->all(FLERR, "Pair style circuloline: no pair_coeff for types {} and {}", i, j);
  eps[j][i] = eps[i][j];
  return delta + (contact == SEGMENT ? 2.0 : 1.0) * longest_edge;
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      fwrite(&setflag[i][j], sizeof(int), 1, fp);
      if (setflag[i][j]) fwrite(&eps[i][j], sizeof(double), 1, fp);
    }
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();

  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      if (comm->me == 0) utils::sfread(FLERR, &setflag[i][j], sizeof(int), 1, fp, nullptr, error);
      MPI_Bcast(&setflag[i][j], 1, MPI_INT, 0, world);
      if (setflag[i][j]) {
        if (comm->me == 0) utils::sfread(FLERR, &eps[i][j], sizeof(double), 1, fp, nullptr, error);
        MPI_Bcast(&eps[i][j], 1, MPI_DOUBLE, 0, world);
      }
    }
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_restart_settings(FILE *fp)
{
  const int form = contact;
  fwrite(&delta, sizeof(double), 1, fp);
  fwrite(&longest_edge, sizeof(double), 1, fp);
  fwrite(&form, sizeof(int), 1, fp);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::read_restart_settings(FILE *fp)
{
  int form = OUTLINE;
  if (comm->me == 0) {
    utils::sfread(FLERR, &delta, sizeof(double), 1, fp, nullptr, error);
    utils::sfread(FLERR, &longest_edge, sizeof(double), 1, fp, nullptr, error);
    utils::sfread(FLERR, &form, sizeof(int), 1, fp, nullptr, error);
  }
  MPI_Bcast(&delta, 1, MPI_DOUBLE, 0, world);
  MPI_Bcast(&longest_edge, 1, MPI_DOUBLE, 0, world);
  MPI_Bcast(&form, 1, MPI_INT, 0, world);
  contact = static_cast<Contact>(form);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++) fprintf(fp, "%d %.17g\n", i, eps[i][i]);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) fprintf(fp, "%d %d %.17g\n", i, j, eps[i][j]);
}

/* ---------------------------------------------------------------------- */

int PairCirculoline::pack_reverse_comm(int n, int first, double *buf)
{
  std::copy_n(&ghost_force[2 * first], 2 * n, buf);
  return 2 * n;
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::unpack_reverse_comm(int n, int *indices, double *buf)
{
  for (int k = 0; k < n; k++) {
    ghost_force[2 * indices[k]] += buf[2 * k];
    ghost_force[2 * indices[k] + 1] += buf[2 * k + 1];
  }
}

/* ---------------------------------------------------------------------- */

void *PairCirculoline::extract(const char *str, int &dim)
{
  dim = 0;
  if (strcmp(str, "delta") == 0) return (void *) &delta;
  if (strcmp(str, "longest_edge") == 0) return (void *) &longest_edge;
  dim = 2;
  if (strcmp(str, "eps") == 0) return (void *) eps;
  return nullptr;
}

/* ---------------------------------------------------------------------- */

double PairCirculoline::memory_usage()
{
  return Pair::memory_usage() + facings.capacity() * sizeof(Facing) +
      edges.capacity() * sizeof(Edge) + successor.capacity() * sizeof(int) +
      ghost_force.capacity() * sizeof(double);
}
