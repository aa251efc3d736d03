// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fix.h"
#include "overdamped_flow.h"

namespace LAMMPS_NS {

/* Overdamped simple shear of disks or droplets, among the commands of LAMMPS: what the fix
   refuses, the parts of a step, ghosts, neighbors and files, and the box, which flips when it leans
   too far. The flow has the physics: disk_flow.h or droplet_flow.h. */
class FixOverdamped : public Fix, private GhostExchange {
 public:
  FixOverdamped(class LAMMPS *, int, char **);
  ~FixOverdamped() override;
  int setmask() override;
  void init() override;
  void setup_pre_force(int vflag) override { pre_force(vflag); }
  void pre_force(int) override { flow->find_body_forces(); }
  void setup(int) override;
  void initial_integrate(int) override;
  void pre_exchange() override;
  void final_integrate() override;
  void post_run() override;
  double compute_vector(int n) override { return flow->column(n); }
  void write_restart(FILE *) override;
  void restart(char *) override;
  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;
  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;
  int pack_restart(int, double *) override;
  void unpack_restart(int, int) override;
  int size_restart(int) override { return maxexchange + 1; }
  int maxsize_restart() override { return maxexchange + 1; }
  double memory_usage() override { return flow->memory_usage(); }

 private:
  std::unique_ptr<OverdampedFlow> flow;
  std::vector<Field *> fields;    // of the flow, which travel with atoms
  double user_time_step;        // that the flow changes
  bigint last_timestep = -1;    // of the last run, at which velocities hold
  bool stopped = false;         // this run, at the end of an interval
  int flip = 0;
  Field *traveling = nullptr;

  void check() const;
  std::vector<Fix *> check_forces() const;
  void move_back();
  void show_velocities();
  void send_to_ghosts(Field &) override;
  void add_from_ghosts(Field &) override;
};

}    // namespace LAMMPS_NS
