// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>

namespace LAMMPS_NS {

/* Whether the value of a variable reads another one: as v_NAME or ${NAME}, or NAME=, in the words
   of a law. */
bool reads_variable(const std::string &value, const std::string &name);

/* What the text of decks says of their variables. A line

     variable NAME index DEFAULT   # LIMITS: what it is

   lets `lmp -var NAME VALUE` replace the default. LIMITS are an interval, as "(0, 2]" or "[2, 1e6]
   even", or words, as "cg | fire", or "file", which must exist. Without them a number is at least
   0, and above 0 if its default is. "; sp only" or "; dp only" at the end: for that model;
   "; random start only": where the deck reads no data file. jamlab/cli/decks.py reads the same
   lines. A line "# optional: NAME .." has those without a default. */
class DeckText {
 public:
  using Value =
      std::function<std::string(const std::string &)>;    // of a variable; "" if undefined

  /* Reads a deck and all that it includes by `include "${dir}/PART"`. */
  void read(const std::string &text, const Value &value);

  /* Whether `lmp -var` may give a variable of that name. */
  bool takes(const std::string &name) const;
  /* Whether that variable has no default, and may have several values. */
  bool optional_one(const std::string &name) const { return optional.count(name); }
  /* Whether the text sets that variable, and `lmp -var` may not. */
  bool computes(const std::string &name) const;
  /* What a value must be, in words; "" if it is that. */
  std::string must_be(const std::string &name, const std::string &value) const;
  /* The variable that a misspelt one may stand for, or all of them. */
  std::string meant(const std::string &name) const;

 private:
  struct Given {
    std::string default_value, comment;    // what stands behind it
  };
  std::map<std::string, Given> given;
  std::string model;
  std::set<std::string> optional;    // without a default
  std::set<std::string> families;    // "d": d1, d2, ..
  std::set<std::string> computed;

  void read_line(const std::string &line);
  bool used(const Given &variable) const;
  std::string offered() const;
};

}    // namespace LAMMPS_NS
