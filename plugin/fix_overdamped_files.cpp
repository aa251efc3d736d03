// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* What travels with the disks, between ranks, and into restart files. */

#include "fix_overdamped.h"

#include "atom.h"
#include "comm.h"
#include "force.h"

#include <cstring>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void FixOverdamped::write_restart(FILE *fp)
{
  if (comm->me != 0) return;
  const std::vector<DiskDrag::Edge> edges = disks ? disks->edges() : std::vector<DiskDrag::Edge>();
  const int count = static_cast<int>(edges.size());
  const int size = static_cast<int>(sizeof(State) + sizeof(int) + count * sizeof(DiskDrag::Edge));
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(&state, sizeof(State), 1, fp);
  fwrite(&count, sizeof(int), 1, fp);
  fwrite(edges.data(), sizeof(DiskDrag::Edge), count, fp);
}

/* ---------------------------------------------------------------------- */

void FixOverdamped::restart(char *buf)
{
  std::memcpy(&state, buf, sizeof(State));
  int count;
  std::memcpy(&count, buf + sizeof(State), sizeof(int));
  restored.resize(count);
  std::memcpy(restored.data(), buf + sizeof(State) + sizeof(int), count * sizeof(DiskDrag::Edge));
}

/* ---------------------------------------------------------------------- */

void FixOverdamped::send_to_ghosts(Motions &motions)
{
  traveling = &motions;
  comm->forward_comm(this, 3);
}

/* ----------------------------------------------------------------------
   where newton is off, both owners see a contact of disks, and each counts it for its own disk
------------------------------------------------------------------------- */

void FixOverdamped::add_from_ghosts(Motions &motions)
{
  if (!droplets && !force->newton_pair) return;
  traveling = &motions;
  comm->reverse_comm(this, 3);
}

/* ---------------------------------------------------------------------- */

static int put(double *buf, const Motion &motion)
{
  buf[0] = motion.x;
  buf[1] = motion.y;
  buf[2] = motion.spin;
  return 3;
}

/* ---------------------------------------------------------------------- */

int FixOverdamped::pack_forward_comm(int n, int *indices, double *buf, int /*pbc_flag*/, int * /*pbc*/)
{
  for (int k = 0; k < n; k++) buf += put(buf, (*traveling)[indices[k]]);
  return 3 * n;
}

/* ---------------------------------------------------------------------- */

void FixOverdamped::unpack_forward_comm(int n, int first, double *buf)
{
  for (int i = first; i < first + n; i++, buf += 3) (*traveling)[i] = {buf[0], buf[1], buf[2]};
}

/* ---------------------------------------------------------------------- */

int FixOverdamped::pack_reverse_comm(int n, int first, double *buf)
{
  for (int i = first; i < first + n; i++) buf += put(buf, (*traveling)[i]);
  return 3 * n;
}

/* ---------------------------------------------------------------------- */

void FixOverdamped::unpack_reverse_comm(int n, int *indices, double *buf)
{
  for (int k = 0; k < n; k++, buf += 3) {
    Motion &sum = (*traveling)[indices[k]];
    sum.x += buf[0];
    sum.y += buf[1];
    sum.spin += buf[2];
  }
}

/* ---------------------------------------------------------------------- */

void FixOverdamped::grow_arrays(int nmax)
{
  for (Motions *each : {&now, &before, &moved, &moved_before}) each->resize(nmax);
}

/* ---------------------------------------------------------------------- */

void FixOverdamped::copy_arrays(int i, int j, int /*delflag*/)
{
  for (Motions *each : {&now, &before, &moved, &moved_before}) (*each)[j] = (*each)[i];
}

/* ---------------------------------------------------------------------- */

void FixOverdamped::set_arrays(int i)
{
  now[i] = before[i] = moved[i] = moved_before[i] = Motion();
}

/* ---------------------------------------------------------------------- */

int FixOverdamped::pack_exchange(int i, double *buf)
{
  put(buf, now[i]);
  put(buf + 3, before[i]);
  put(buf + 6, moved[i]);
  put(buf + 9, moved_before[i]);
  return PER_ATOM;
}

/* ---------------------------------------------------------------------- */

int FixOverdamped::unpack_exchange(int i, double *buf)
{
  now[i] = {buf[0], buf[1], buf[2]};
  before[i] = {buf[3], buf[4], buf[5]};
  moved[i] = {buf[6], buf[7], buf[8]};
  moved_before[i] = {buf[9], buf[10], buf[11]};
  return PER_ATOM;
}

/* ---------------------------------------------------------------------- */

int FixOverdamped::pack_restart(int i, double *buf)
{
  buf[0] = PER_ATOM + 1;
  pack_exchange(i, buf + 1);
  return PER_ATOM + 1;
}

/* ---------------------------------------------------------------------- */

void FixOverdamped::unpack_restart(int i, int nth)
{
  double *extra = atom->extra[i];
  int m = 0;
  for (int k = 0; k < nth; k++) m += static_cast<int>(extra[m]);
  unpack_exchange(i, extra + m + 1);
}

/* ---------------------------------------------------------------------- */

int FixOverdamped::size_restart(int /*i*/)
{
  return PER_ATOM + 1;
}

/* ---------------------------------------------------------------------- */

int FixOverdamped::maxsize_restart()
{
  return PER_ATOM + 1;
}

/* ---------------------------------------------------------------------- */

double FixOverdamped::memory_usage()
{
  return (4 * now.capacity() + pushes.capacity()) * sizeof(Motion) + (solver ? solver->memory_usage() : 0.0);
}
