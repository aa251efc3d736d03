// SPDX-License-Identifier: GPL-2.0-or-later
#include "command_quiet.h"

#include "error.h"
#include "input_members.h"

#include <cstdio>
#include <cstring>

using namespace LAMMPS_NS;

namespace {

/* A stream that lets some lines through to the screen. LAMMPS writes a message, or a part of a
   line, at a time; what the first part of a line is decides for the rest of it. */
struct Sieve {
  Input *input;
  FILE *screen;
  bool begins = true, passes = false;

  bool wanted(const char *text, size_t size) const
  {
    const char *const command = command_of(*input);
    if (command && strcmp(command, "print") == 0) return true;
    for (const char *word : {"ERROR", "WARNING", "REFUSED"})
      if (size >= strlen(word) && strncmp(text, word, strlen(word)) == 0) return true;
    return false;
  }

  void write(const char *text, size_t size)
  {
    if (begins) passes = wanted(text, size);
    begins = text[size - 1] == '\n';
    if (!passes) return;
    fwrite(text, 1, size, screen);
    fflush(screen);
  }

  void close()
  {
    if (screen != stdout) fclose(screen);
    delete this;
  }
};

#if defined(__GLIBC__) || defined(__linux__)
ssize_t write_some(void *sieve, const char *text, size_t size)
{
  if (size) static_cast<Sieve *>(sieve)->write(text, size);
  return static_cast<ssize_t>(size);
}

int close_all(void *sieve)
{
  static_cast<Sieve *>(sieve)->close();
  return 0;
}

FILE *stream(Sieve *sieve)
{
  return fopencookie(sieve, "w", {nullptr, write_some, nullptr, close_all});
}
#else    // macOS and BSD
int write_some(void *sieve, const char *text, int size)
{
  if (size) static_cast<Sieve *>(sieve)->write(text, size);
  return size;
}

int close_all(void *sieve)
{
  static_cast<Sieve *>(sieve)->close();
  return 0;
}

FILE *stream(Sieve *sieve)
{
  return funopen(sieve, nullptr, write_some, nullptr, close_all);
}
#endif

}    // namespace

void CommandQuiet::command(int narg, char ** /*arg*/)
{
  if (narg) error->all(FLERR, "jamlab/quiet takes no arguments");
  if (!screen || echo_of(*input)) return;    // of other ranks, or -screen none, or -echo screen
  auto *const sieve = new Sieve{input, screen};
  FILE *const quiet = stream(sieve);
  if (!quiet) {
    delete sieve;
    error->one(FLERR, "jamlab/quiet: no memory for a stream");
  }
  setvbuf(quiet, nullptr, _IONBF, 0);    // each message arrives while its command runs
  screen = quiet;
}
