// SPDX-License-Identifier: GPL-2.0-or-later

/* LAMMPS enters the plugin here. The styles are a library of their own, which is opened only by a
   LAMMPS that they fit: another one would lack some of its symbols, and say no more than that. */

#include "lammps.h"
#include "lmptype.h"

#include <cstdlib>
#include <dlfcn.h>
#include <mpi.h>
#include <string>

using namespace LAMMPS_NS;

extern "C" {
// the library interface of LAMMPS is the same in every version, unlike its C++ classes
int lammps_version(void *);
int lammps_extract_setting(void *, const char *);
int lammps_config_has_mpi_support();
void lammps_error(void *, int, const char *);

__attribute__((visibility("default"))) void lammpsplugin_init(void *, void *, void *);
}

static constexpr int WARNING = 0;
static constexpr char NO_MPI[] = "no MPI (STUBS)";

// BUILT_MPI names the MPI of mpi.h, or another in tests.
#if defined(JAMLAB_MPI)
static constexpr char BUILT_MPI[] = JAMLAB_MPI;
#elif defined(OPEN_MPI)
static constexpr char BUILT_MPI[] = "Open MPI";
#elif defined(MPICH_VERSION) || defined(I_MPI_VERSION)
static constexpr char BUILT_MPI[] = "MPICH";
#elif defined(MPI_STUBS)
static constexpr const char *BUILT_MPI = NO_MPI;
#else
static constexpr char BUILT_MPI[] = "";
#endif

/* Updates of one version may lay out its classes differently: Pair has grown in update 4 of 22
   Jul 2025. Where LAMMPS was built from git, only its tag says the update:
   "stable_22Jul2025_update4". */
static std::string update_of_lammps()
{
  const std::string tag = LAMMPS::git_descriptor(), word = "_update";
  if (tag.rfind("stable_", 0) != 0) return "";
  const auto at = tag.find(word);
  return at == std::string::npos ? "0" : std::to_string(std::atoi(tag.c_str() + at + word.size()));
}

/* The family of the MPI that runs matters: handles are numbers in one and pointers in the other, so
   code compiled for one crashes in the other. The name is empty where it cannot be told. */
static std::string mpi_of_lammps()
{
  if (!lammps_config_has_mpi_support()) return NO_MPI;
  using function = int (*)(char *, int *);
  const auto version = reinterpret_cast<function>(dlsym(RTLD_DEFAULT, "MPI_Get_library_version"));
  if (!version) return "";
  char text[8192] = "";    // MPICH writes its configuration, up to 8192 characters
  int length = 0;
  version(text, &length);
  const std::string found(text);
  if (found.find("Open MPI") != std::string::npos) return "Open MPI";
  for (const char *name : {"MPICH", "Intel(R) MPI", "MVAPICH"})    // one binary interface
    if (found.find(name) != std::string::npos) return "MPICH";
  return "";
}

static std::string sizes(size_t big, size_t tag, size_t image)
{
  return std::to_string(8 * big) + "-, " + std::to_string(8 * tag) + "- and " +
      std::to_string(8 * image) + "-bit bigint, tagint and imageint";
}

/* Says why this LAMMPS cannot use the plugin; the text is empty if it can. */
static std::string misfit(void *lmp)
{
  const int found = lammps_version(lmp);
  if (found != JAMLAB_LAMMPS_VERSION)
    return "for LAMMPS version " + std::to_string(JAMLAB_LAMMPS_VERSION) + ", this is " +
        std::to_string(found);

  const std::string update = update_of_lammps();
  if (!update.empty() && update != JAMLAB_LAMMPS_UPDATE)
    return "for update " JAMLAB_LAMMPS_UPDATE " of LAMMPS " JAMLAB_LAMMPS_DATE ", this is update " +
        update;

  const std::string built = sizes(sizeof(bigint), sizeof(tagint), sizeof(imageint));
  const auto bytes = [lmp](const char *type) { return lammps_extract_setting(lmp, type); };
  const std::string wanted = sizes(bytes("bigint"), bytes("tagint"), bytes("imageint"));
  if (built != wanted) return "with " + built + ", this LAMMPS has " + wanted;

  const std::string mpi = mpi_of_lammps(), built_mpi = BUILT_MPI;
  const bool known = !mpi.empty() && !built_mpi.empty();
  return known && mpi != built_mpi ? "with " + built_mpi + ", this LAMMPS has " + mpi : "";
}

/* The library of the styles lies in the folder of this one. */
static std::string styles_file()
{
  Dl_info here;
  if (!dladdr(reinterpret_cast<void *>(&lammpsplugin_init), &here)) return JAMLAB_STYLES;
  const std::string file = here.dli_fname;
  return file.substr(0, file.rfind('/') + 1) + JAMLAB_STYLES;
}

void lammpsplugin_init(void *lmp, void *handle, void *regfunc)
{
  const auto warn = [lmp](const std::string &message) {
    if (lammps_extract_setting(lmp, "world_rank") == 0) lammps_error(lmp, WARNING, message.c_str());
  };

  const std::string reason = misfit(lmp);
  if (!reason.empty()) {
    warn("The jamlab plugin was built " + reason +
         ": its styles are not available here; rebuild jamlab against this LAMMPS to have them");
    return;
  }

  // the library is never closed: LAMMPS may hold objects of its classes,
  // and the screen of jamlab/quiet, to the end
  void *const styles = dlopen(styles_file().c_str(), RTLD_NOW | RTLD_LOCAL);
  void *const add = styles ? dlsym(styles, "jamlab_register") : nullptr;
  if (!add) {
    warn("The jamlab plugin cannot open its styles (" + std::string(dlerror()) +
         "): they are not available here; rebuild jamlab against this LAMMPS to have them");
    return;
  }
  reinterpret_cast<void (*)(void *, void *, void *)>(add)(lmp, handle, regfunc);
}
