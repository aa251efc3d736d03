// SPDX-License-Identifier: GPL-2.0-or-later
#include "command_law.h"

#include "comm.h"
#include "deck_refusals.h"
#include "error.h"
#include "input.h"
#include "lammps.h"
#include "platform.h"
#include "utils.h"
#include "variable.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

using Words = std::map<std::string, std::string>;

constexpr char MARK[] = "# jamlab ";    // MARK of jamlab/packing/lammps_files.py
constexpr double SAME = 1e-9;           // relative difference of numbers that were typed

/* Facts of a data file: those of its last comment, and sizes beside the masses. */
struct DataFile {
  Words facts;
  std::vector<std::string> sizes;    // by type, of disks
  bool readable, of_lammps = false, bonds = false, size_of_each = false;

  DataFile(const std::string &name)
  {
    std::ifstream file(name);
    readable = file.good();
    bool masses = false;
    for (std::string line; std::getline(file, line);) {
      if (line.rfind(MARK, 0) == 0) {
        facts.clear();
        std::istringstream words(line.substr(sizeof(MARK) - 1));
        for (std::string word; words >> word;)
          if (const auto at = word.find('='); at != word.npos)
            facts[word.substr(0, at)] = word.substr(at + 1);
      }
      of_lammps |= line.find(" atoms") != line.npos;
      bonds |= line.rfind("Bonds", 0) == 0;
      size_of_each |= line.rfind("d_diameter", 0) == 0;
      if (!line.empty() && std::isalpha(static_cast<unsigned char>(line[0])))
        masses = line.rfind("Masses", 0) == 0;
      if (const auto at = line.find("# diameter "); masses && at != line.npos)
        sizes.push_back(line.substr(at + 11));
    }
  }

  std::string fact(const std::string &name) const
  {
    const auto found = facts.find(name);
    return found == facts.end() ? "" : found->second;
  }
};

/* Whether that is the diameter of an atom type: d1, d2, ... */
bool size_of_type(const std::string &name)
{
  return name.size() > 1 && name[0] == 'd' &&
         name.find_first_not_of("0123456789", 1) == name.npos;
}

/* Variables by which a deck of disks knows the law: an exponent of 2 and springs that only push are
   not written. */
Words law_of_disks(const DataFile &data)
{
  const std::string units = data.fact("units");
  Words law;
  if (!units.empty()) law = {{"units", units}, {units, data.fact(units)}};
  if (data.fact("law").empty()) {
    law["exponent"] = data.fact("exponent").empty() ? "2" : data.fact("exponent");
    law["stickiness"] = data.fact("stickiness").empty() ? "0" : data.fact("stickiness");
  }
  for (size_t k = 0; k < data.sizes.size(); k++) law["d" + std::to_string(k + 1)] = data.sizes[k];
  for (const auto &[name, value] : data.facts)
    if (size_of_type(name)) law[name] = value;
  return law;
}

Words law_of_droplets(const DataFile &data)
{
  Words law;
  for (const char *name : {"units", "gamma", "ka", "eps", "delta", "eta", "contact", "adhesion",
                           "adhesion_range", "kappa", "theta0", "kp", "kl", "p0"})
    if (const auto value = data.fact(name); !value.empty()) law[name] = value;
  return law;
}

bool same(const std::string &a, const std::string &b)
{
  char *end_a = nullptr, *end_b = nullptr;
  const double x = std::strtod(a.c_str(), &end_a), y = std::strtod(b.c_str(), &end_b);
  if (a.empty() || b.empty() || *end_a || *end_b) return a == b;
  return std::fabs(x - y) <= SAME * std::max(std::fabs(x), std::fabs(y));
}

std::string ratio_of(const Words &law)
{
  const auto small = law.find("d1"), large = law.find("d2");
  if (small == law.end() || large == law.end() || law.count("d3")) return "";
  const double size = std::atof(small->second.c_str());
  return fmt::format("{:.12g}", std::atof(large->second.c_str()) / size);
}

/* Whether a variable says something of a law. */
bool of_law(const std::string &name)
{
  for (const char *each : {"units", "eps", "k", "exponent", "stickiness", "size_ratio",
                           "pair_style", "gamma", "ka", "delta", "eta", "contact", "adhesion",
                           "adhesion_range", "kappa", "theta0", "kp", "kl", "p0"})
    if (name == each) return true;
  return size_of_type(name);
}

/* Why a deck of that model cannot take the file; "" if it can. */
std::string misfit(const DataFile &data, const std::string &model, const std::string &name,
                   const Words &given)
{
  if (!data.readable)
    return fmt::format("there is no file {}: give -var data FILE; in.{}.jam writes {}.onset.data",
                       name, model, model);
  if (!data.of_lammps && !platform::has_compress_extension(name))
    return fmt::format("data = {}: no data file of LAMMPS; jamlab.write and other decks write one",
                       name);
  const std::string found = data.facts.empty() ? (data.bonds ? "dp" : "sp") : data.fact("model");
  if (found != model && (!data.facts.empty() || found == "dp"))
    return fmt::format("data = {}: it holds {}, but this deck takes {}", name,
                       found == "dp"   ? "droplets"
                       : found == "sp" ? "disks"
                                       : "the model " + found,
                       model == "dp" ? "droplets: use in.sp.*" : "disks: use in.dp.*");
  if (data.size_of_each)
    return fmt::format(
        "data = {}: each disk has its own diameter, but decks take it from the atom type: "
        "use jamlab in Python",
        name);
  const std::string law = data.fact("law");
  const bool of_droplets = law.empty() || law == "rim" || law == "adhesive";
  if (model == "dp" && !of_droplets)
    return fmt::format("data = {}: decks of droplets have no law={}: use jamlab in Python", name,
                       law);
  if (model == "sp" && !law.empty() && !given.count("pair_style"))
    return fmt::format(
        "data = {}: give the pair_style of law={}, see parts/sp; for a law of a package "
        "use `jamlab deck`",
        name, law);
  return "";
}

}    // namespace

void CommandLaw::command(int narg, char **arg)
{
  if (narg != 2) error->all(FLERR, "jamlab/law needs a model, sp or dp, and a data file");
  const std::string model = arg[0], file = arg[1];
  if (model != "sp" && model != "dp")
    error->all(FLERR, "jamlab/law: model {} must be sp or dp", model);
  const Words given = texts_of_variables(lmp, of_law);
  std::vector<std::string> wrong;
  std::string found = "variable not_converged delete\n";    // commands
  if (comm->me == 0) {
    const DataFile data(file);
    if (const auto why = misfit(data, model, file, given); !why.empty())
      wrong.push_back(why);
    else if (!data.facts.empty()) {
      const Words law = model == "sp" ? law_of_disks(data) : law_of_droplets(data);
      for (const auto &[name, value] : law)
        if (const auto old = given.find(name); old == given.end())
          found += fmt::format("variable {} index {}\n", name, value);
        else if (!same(old->second, value))
          wrong.push_back(fmt::format("{} = {}: {} was made with {}; leave it out", name,
                                      old->second, file, value));
      const auto ratio = given.find("size_ratio");
      if (const auto own = ratio_of(law);
          ratio != given.end() && !own.empty() && !same(ratio->second, own))
        wrong.push_back(fmt::format("size_ratio = {}: {} was made with {}; leave it out",
                                    ratio->second, file, own));
      if (data.fact("converged") == "0") {
        found += "variable not_converged index yes\n";
        utils::logmesg(lmp, "WARNING: {} says converged=0: it is no minimum\n", file);
      }
    }
  }
  end_if_refused(lmp, wrong);
  int length = static_cast<int>(found.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, world);
  found.resize(length);
  MPI_Bcast(found.data(), length, MPI_CHAR, 0, world);
  std::istringstream commands(found);
  for (std::string each; std::getline(commands, each);) input->one(each);
}
