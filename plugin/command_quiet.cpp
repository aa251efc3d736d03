// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "command_quiet.h"

#include "error.h"
#include "input.h"

#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void CommandQuiet::command(int narg, char **arg)
{
  if (narg < 1) error->all(FLERR, "jamlab/quiet needs a command to run");

  // Input parses into the memory behind arg: copy first, and quote again what was quoted
  std::string line;
  for (int i = 0; i < narg; i++) {
    const std::string word = arg[i];
    const bool plain = !word.empty() && word.find_first_of(" \t\n$") == std::string::npos;
    const std::string quote = plain ? "" : word.find('"') == std::string::npos ? "\"" : "'";
    line += (i ? " " : "") + quote + word + quote;
  }

  FILE *const shown = screen;
  if (!shown) {    // other ranks, or -screen none
    input->one(line);
    return;
  }
  char *text = nullptr;
  size_t length = 0;
  FILE *const withheld = open_memstream(&text, &length);
  if (!withheld) error->one(FLERR, "jamlab/quiet: no memory for the output of {}", line);
  screen = withheld;
  try {
    input->one(line);
  } catch (...) {
    screen = shown;
    fclose(withheld);
    fputs(text, shown);
    free(text);
    throw;
  }
  screen = shown;
  fclose(withheld);

  std::istringstream lines(std::string(text, length));
  free(text);
  for (std::string shout; std::getline(lines, shout);)
    if (shout.rfind("WARNING", 0) == 0) fprintf(shown, "%s\n", shout.c_str());
  fflush(shown);
}
