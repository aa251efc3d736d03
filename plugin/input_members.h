// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "input.h"
#include "variable.h"

#include <cstdio>

namespace LAMMPS_NS {

/* What LAMMPS keeps to itself, in some of its versions: the command that runs, the files that the
   input reads, the first one first, whether the screen shows commands, and the style of each
   variable and how many values it has. An explicit instantiation may name a private member. */
inline char *&command_of(Input &);
inline FILE **&files_of(Input &);
inline int &number_of_files(Input &);
inline int &echo_of(Input &);
inline int *&values_of(Variable &);
inline int *&styles_of(Variable &);

template <char *Input::*Member> struct CommandMember {
  friend inline char *&command_of(Input &input) { return input.*Member; }
};
template <FILE **Input::*Member> struct FilesMember {
  friend inline FILE **&files_of(Input &input) { return input.*Member; }
};
template <int Input::*Member> struct NumberMember {
  friend inline int &number_of_files(Input &input) { return input.*Member; }
};
template <int Input::*Member> struct EchoMember {
  friend inline int &echo_of(Input &input) { return input.*Member; }
};
template <int *Variable::*Member> struct ValuesMember {
  friend inline int *&values_of(Variable &variable) { return variable.*Member; }
};
template <int *Variable::*Member> struct StylesMember {
  friend inline int *&styles_of(Variable &variable) { return variable.*Member; }
};

template struct CommandMember<&Input::command>;
template struct FilesMember<&Input::infiles>;
template struct NumberMember<&Input::nfile>;
template struct EchoMember<&Input::echo_screen>;
template struct ValuesMember<&Variable::num>;
template struct StylesMember<&Variable::style>;

}    // namespace LAMMPS_NS
