// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "pair_circuloline.h"

#include "atom.h"
#include "comm.h"
#include "compute.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

using namespace LAMMPS_NS;

static constexpr char WHO[] = "Pair style circuloline";

/* ---------------------------------------------------------------------- */

PairCirculoline::PairCirculoline(LAMMPS *lmp) : Pair(lmp), eps(nullptr), facings(lmp)
{
  single_enable = 0;    // a contact is more than two atoms
  restartinfo = 1;
  writedata = 1;
  manybody_flag = 1;
  no_virial_fdotr_compute = 1;    // the virial is summed contact by contact, newton on or off
  centroidstressflag = CENTROID_NOTAVAIL;
  comm_forward = 2;    // where a ghost is among the copies of its polygon
  comm_reverse_off = 2;
  delta = longest_edge = 0.0;
  form = OUTLINE;
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

  if (evflag)
    push<true>(f);
  else
    push<false>(f);

  if (own_buffer) {
    comm->reverse_comm(this);
    for (int i = 0; i < atom->nlocal; i++) {
      atom->f[i][0] += f[i][0];
      atom->f[i][1] += f[i][1];
    }
  }
}

/* ----------------------------------------------------------------------
   push each vertex away from the edge that it touches; tally the contact once,
   on the atom that this rank owns
------------------------------------------------------------------------- */

template <bool TALLY> void PairCirculoline::push(double *const *f)
{
  for_each_contact([this, f](int owner, int vertex, PolygonFacings::Edge edge, const Foot &foot) {
    const Push push = push_on_vertex(vertex, edge, foot);
    f[vertex][0] += push.fx;
    f[vertex][1] += push.fy;
    f[edge.tail][0] -= (1.0 - foot.t) * push.fx;
    f[edge.tail][1] -= (1.0 - foot.t) * push.fy;
    f[edge.head][0] -= foot.t * push.fx;
    f[edge.head][1] -= foot.t * push.fy;

    if (TALLY) {
      const double energy = 0.5 * push.strength * push.overlap * push.overlap;
      const double v[6] = {foot.dx * push.fx, foot.dy * push.fy, 0.0, foot.dx * push.fy, 0.0, 0.0};
      if (eflag_global) eng_vdwl += energy;
      if (eflag_atom) eatom[owner] += energy;
      for (int k = 0; k < 6; k++) {
        if (vflag_global) virial[k] += v[k];
        if (vflag_atom) vatom[owner][k] += v[k];
      }
    }
  });
}

/* ----------------------------------------------------------------------
   E = (eps/2) (1 - d/delta)^2; crossing edges (d = 0) have no direction and no force
------------------------------------------------------------------------- */

PairCirculoline::Push PairCirculoline::push_on_vertex(int vertex, PolygonFacings::Edge edge,
                                                      const Foot &foot) const
{
  const double per_delta = 1.0 / delta;
  const double d = sqrt(foot.rsq);
  const double overlap = 1.0 - d * per_delta;
  const double strength = eps[atom->type[vertex]][atom->type[edge.tail]];
  const double magnitude = d > 0.0 ? strength * overlap * per_delta / d : 0.0;
  return {d, strength, overlap, magnitude * foot.dx, magnitude * foot.dy};
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::find_facings()
{
  facings.mark();
  comm->forward_comm(this);
  facings.build(list, CONTACT_FORMS[form].grouping, delta + neighbor->skin, longest_edge);
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
   pair_style circuloline delta longest_edge [contact form]
------------------------------------------------------------------------- */

void PairCirculoline::settings(int narg, char **arg)
{
  if (narg != 2 && narg != 4)
    error->all(FLERR, "Pair style circuloline needs: delta longest_edge [contact {}]",
               contact_form_names("|"));

  delta = utils::numeric(FLERR, arg[0], false, lmp);
  longest_edge = utils::numeric(FLERR, arg[1], false, lmp);
  if (delta <= 0.0) error->all(FLERR, "Pair style circuloline: delta {} must be positive", arg[0]);
  if (longest_edge <= 0.0)
    error->all(FLERR, "Pair style circuloline: longest edge {} must be positive", arg[1]);

  form = OUTLINE;
  if (narg == 4) {
    if (strcmp(arg[2], "contact") != 0)
      error->all(FLERR, "Pair style circuloline: unknown keyword {}, expected contact", arg[2]);
    int k = 0;
    while (k < NUMBER_OF_CONTACT_FORMS && strcmp(arg[3], CONTACT_FORMS[k].name) != 0) k++;
    if (k == NUMBER_OF_CONTACT_FORMS)
      error->all(FLERR, "Pair style circuloline: unknown contact form {}, use one of {}", arg[3],
                 contact_form_names(", "));
    form = static_cast<ContactForm>(k);
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
  refuse_computes();
  facings.init(WHO);
  for (int k = 0; k < neighbor->nex_mol; k++)
    if (neighbor->ex_mol_intra[k] && comm->me == 0)
      error->warning(FLERR, "Pair style circuloline: neigh_modify exclude molecule/intra hides the contacts "
                     "of a polygon with its own periodic images");
  neighbor->add_request(this, NeighConst::REQ_FULL);
}

/* ----------------------------------------------------------------------
   computes that would take the neighbors of a vertex for its contacts without a
   word; LAMMPS itself refuses those that call single()
------------------------------------------------------------------------- */

void PairCirculoline::refuse_computes() const
{
  for (const char *style : {"^pair/local", "/tally$"})
    for (const Compute *compute : modify->get_compute_by_style(style)) {
      int vertices = 0;
      for (int i = 0; i < atom->nlocal; i++)
        if (atom->molecule[i] && (atom->mask[i] & compute->groupbit)) vertices = 1;
      MPI_Allreduce(MPI_IN_PLACE, &vertices, 1, MPI_INT, MPI_MAX, world);
      if (vertices)
        error->all(FLERR, "Pair style circuloline: compute {} of style {} knows pairs of atoms only, and a contact "
                   "is a vertex and an edge: use compute polygon/contact, or a group without polygons",
                   compute->id, compute->style);
    }
}

/* ----------------------------------------------------------------------
   the edges near a vertex are known by local and ghost index, which a command
   between two runs may change
------------------------------------------------------------------------- */

void PairCirculoline::refuse_stale_facings() const
{
  if (!facings.fit_atoms())
    error->one(FLERR, "Pair style circuloline: atoms have changed since the last run: use run 0 first");
}

/* ----------------------------------------------------------------------
   an edge within reach of a vertex has its tail within delta + its length;
   two edges within reach have tails within delta + both lengths
------------------------------------------------------------------------- */

double PairCirculoline::init_one(int i, int j)
{
  if (setflag[i][j] == 0)
    error->all(FLERR, "Pair style circuloline: no pair_coeff for types {} and {} (a data file has it if "
               "written with write_data ... pair ij)", i, j);
  eps[j][i] = eps[i][j];
  return delta + CONTACT_FORMS[form].edges * longest_edge;
}

/* ---------------------------------------------------------------------- */

int PairCirculoline::pack_forward_comm(int n, int *list, double *buf, int /*pbc_flag*/, int *pbc)
{
  return facings.pack(n, list, buf, pbc);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::unpack_forward_comm(int n, int first, double *buf)
{
  facings.unpack(n, first, buf);
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
  if (strcmp(str, "delta") == 0) return &delta;
  if (strcmp(str, "longest_edge") == 0) return &longest_edge;
  dim = 2;
  if (strcmp(str, "eps") == 0) return eps;
  return nullptr;
}

/* ---------------------------------------------------------------------- */

double PairCirculoline::memory_usage()
{
  return Pair::memory_usage() + facings.memory_usage() + ghost_force.capacity() * sizeof(double);
}
