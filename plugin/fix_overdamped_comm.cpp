// SPDX-License-Identifier: GPL-2.0-or-later

/* What travels with the disks, between ranks, and into restart files. */

#include "fix_overdamped.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"

#include <algorithm>

using namespace LAMMPS_NS;

void FixOverdamped::write_restart(FILE *fp)
{
  if (comm->me != 0) return;
  const double *const kept = &state.time;
  std::vector<double> list(1, LAYOUT);
  list.insert(list.end(), kept, kept + KEPT);
  if (disks)
    for (const DiskDrag::MarginalContact &edge : disks->marginal_contacts())
      list.insert(list.end(), {static_cast<double>(edge.first), static_cast<double>(edge.second),
                               static_cast<double>(edge.state), edge.theta, edge.base, edge.held,
                               static_cast<double>(edge.tried), edge.free ? 1.0 : 0.0});
  list.insert(list.begin() + 1, static_cast<double>(list.size() - 1 - KEPT));
  const int size = static_cast<int>(list.size() * sizeof(double));
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(list.data(), sizeof(double), list.size(), fp);
}

void FixOverdamped::restart(char *buf)
{
  const double *list = reinterpret_cast<const double *>(buf);
  if (*list != LAYOUT)
    error->all(FLERR, "Fix overdamped: the restart file was written by another version of this plugin, which can "
               "end the flow; or start a flow anew from a data file of its state");
  const int numbers = static_cast<int>(list[1]);
  list += 2;
  std::copy(list, list + KEPT, &state.time);
  list += KEPT;
  restored.clear();
  for (const double *const end = list + numbers; list < end; list += 8)
    restored.push_back({static_cast<tagint>(list[0]), static_cast<tagint>(list[1]), static_cast<int>(list[2]),
                        list[3], list[4], list[5], static_cast<int>(list[6]), list[7] != 0.0});
}

void FixOverdamped::send_to_ghosts(Field &motions)
{
  traveling = &motions;
  comm->forward_comm(this, 3);
}

/* where newton is off, both owners see a contact of disks, and each counts it for its own disk */
void FixOverdamped::add_from_ghosts(Field &motions)
{
  if (!droplets && !force->newton_pair) return;
  traveling = &motions;
  comm->reverse_comm(this, 3);
}

int FixOverdamped::pack_forward_comm(int n, int *indices, double *buf, int /*pbc_flag*/, int * /*pbc*/)
{
  for (int k = 0; k < n; k++) std::copy_n(&(*traveling)[indices[k]].x, 3, buf + 3 * k);
  return 3 * n;
}

void FixOverdamped::unpack_forward_comm(int n, int first, double *buf)
{
  if (n) std::copy_n(buf, 3 * n, &(*traveling)[first].x);
}

int FixOverdamped::pack_reverse_comm(int n, int first, double *buf)
{
  if (n) std::copy_n(&(*traveling)[first].x, 3 * n, buf);
  return 3 * n;
}

void FixOverdamped::unpack_reverse_comm(int n, int *indices, double *buf)
{
  for (int k = 0; k < n; k++, buf += 3) {
    Vec3 &sum = (*traveling)[indices[k]];
    sum = sum + Vec3{buf[0], buf[1], buf[2]};
  }
}

void FixOverdamped::grow_arrays(int nmax)
{
  for (Field *each : fields()) each->resize(nmax);
}

void FixOverdamped::copy_arrays(int i, int j, int /*delflag*/)
{
  for (Field *each : fields()) (*each)[j] = (*each)[i];
}

void FixOverdamped::set_arrays(int i)
{
  for (Field *each : fields()) (*each)[i] = Vec3();
}

int FixOverdamped::pack_exchange(int i, double *buf)
{
  for (const Field *each : fields()) buf = std::copy_n(&(*each)[i].x, 3, buf);
  return PER_ATOM;
}

int FixOverdamped::unpack_exchange(int i, double *buf)
{
  for (Field *each : fields()) {
    (*each)[i] = {buf[0], buf[1], buf[2]};
    buf += 3;
  }
  return PER_ATOM;
}

int FixOverdamped::pack_restart(int i, double *buf)
{
  buf[0] = PER_ATOM + 1;
  pack_exchange(i, buf + 1);
  return PER_ATOM + 1;
}

void FixOverdamped::unpack_restart(int i, int nth)
{
  double *extra = atom->extra[i];
  int m = 0;
  for (int k = 0; k < nth; k++) m += static_cast<int>(extra[m]);
  unpack_exchange(i, extra + m + 1);
}

double FixOverdamped::memory_usage()
{
  return (4 * velocity.capacity() + forces.capacity()) * sizeof(Vec3) + (solver ? solver->memory_usage() : 0.0);
}
