// SPDX-License-Identifier: GPL-2.0-or-later
#include "command_given.h"

#include "comm.h"
#include "deck_refusals.h"
#include "deck_text.h"
#include "error.h"
#include "input_members.h"
#include "lammps.h"
#include "utils.h"
#include "variable.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <string>
#include <vector>

using namespace LAMMPS_NS;

namespace {

/* All of a file, whose place of reading stays; "" if it cannot be read twice, as a pipe. */
std::string text_of(FILE *file)
{
  const long place = ftell(file);
  std::string text;
  if (place < 0 || fseek(file, 0, SEEK_SET)) return text;
  for (int c = fgetc(file); c != EOF; c = fgetc(file)) text += static_cast<char>(c);
  fseek(file, place, SEEK_SET);
  return text;
}

using Texts = std::map<std::string, std::string>;

/* Variables that this program's arguments give more than once. LAMMPS keeps the first value and
   says nothing. Where another program runs LAMMPS its arguments may look alike: a name counts if
   that variable has the first value. Only Linux has this file. */
std::vector<std::string> given_twice(const Texts &values)
{
  std::ifstream arguments("/proc/self/cmdline");
  std::vector<std::string> words;
  for (std::string word; std::getline(arguments, word, '\0');) words.push_back(word);
  Texts first;
  std::vector<std::string> wrong;
  for (size_t k = 0; k + 2 < words.size(); k++) {
    if (words[k] != "-var" && words[k] != "-v") continue;
    const auto &name = words[k + 1], &text = words[k + 2];
    const auto known = values.find(name);
    if (first.insert({name, text}).second || known == values.end() || known->second != first[name])
      continue;
    wrong.push_back(
        fmt::format("-var {} is given twice, as {} and as {}: give one", name, first[name], text));
  }
  return wrong;
}

/* What is wrong with the variables that exist. The deck is the first of the open files that asks
   for this; those before it are of a user, who may define any. */
std::vector<std::string> refusals(LAMMPS *lmp)
{
  Variable *const variables = lmp->input->variable;
  const auto value = [variables](const std::string &name) -> std::string {
    const char *const found =
        variables->find(name.c_str()) < 0 ? nullptr : variables->retrieve(name.c_str());
    return found ? found : "";
  };
  DeckText user, deck;
  bool in_deck = false;
  for (int k = 0; k < number_of_files(*lmp->input); k++) {
    const auto text = text_of(files_of(*lmp->input)[k]);
    const bool part = text.find("variable started") != text.npos;    // parts/start itself
    in_deck |= text.find("parts/start\"") != text.npos ||
               (text.find("jamlab/given") != text.npos && !part);
    (in_deck ? deck : user).read(text, value);
  }
  if (!in_deck) {    // its text cannot be read again
    utils::logmesg(lmp, "NOT CHECKED: the deck comes through a pipe or from a program, so that any "
                        "-var is taken\n");
    return {};
  }
  const Texts values = texts_of_variables(
      lmp, [&user](const std::string &name) { return !user.computes(name); });
  auto wrong = given_twice(values);
  for (const auto &[name, text] : values) {
    const auto reads = [&name = name](const auto &other) {
      return other.first != name && reads_variable(other.second, name);
    };
    if (std::any_of(values.begin(), values.end(), reads)) continue;
    if (user.takes(name) || name == "jamlab_plugin") continue;
    const int number = variables->find(name.c_str()), count = values_of(*variables)[number];
    if (styles_of(*variables)[number] != Variable::INDEX && !deck.takes(name)) continue;
    if (count > 1 && deck.takes(name) && !deck.optional_one(name)) {
      wrong.push_back(fmt::format("-var {} gives {} values: give one", name, count));
      continue;
    }
    const auto rule = deck.must_be(name, text);
    if (!rule.empty())
      wrong.push_back(fmt::format("{} = {}: must be {}", name, text, rule));
    else if (deck.computes(name))
      wrong.push_back(fmt::format("-var {}: the deck sets it itself; {}", name, deck.meant(name)));
    else if (!deck.takes(name))
      wrong.push_back(fmt::format("-var {}: no such variable; {}", name, deck.meant(name)));
  }
  return wrong;
}

}    // namespace

void CommandGiven::command(int narg, char ** /*arg*/)
{
  if (narg) error->all(FLERR, "jamlab/given takes no arguments");
  end_if_refused(lmp, comm->me == 0 ? refusals(lmp) : std::vector<std::string>());
}
