// SPDX-License-Identifier: GPL-2.0-or-later
#include "deck_text.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <sstream>
#include <vector>

using namespace LAMMPS_NS;

namespace {

bool of_name(char c)
{
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
}

/* The name that stands in a text from a place on. */
std::string name_at(const std::string &text, size_t at)
{
  const auto end = std::find_if_not(text.begin() + at, text.end(), of_name);
  return {text.begin() + at, end};
}

/* A number as decks may compute with it: 1e-3, but neither nan nor 0x1p3. */
bool number(const std::string &text, double &value)
{
  if (text.empty() || text.find_first_not_of("+-.0123456789eE") != std::string::npos) return false;
  char *end = nullptr;
  value = std::strtod(text.c_str(), &end);
  return !*end && value - value == 0.0;
}

bool digits_alone(const std::string &text)
{
  const auto first = text.begin() + (text[0] == '-' || text[0] == '+');
  return first != text.end() && std::all_of(first, text.end(), [](char c) {
           return std::isdigit(static_cast<unsigned char>(c));
         });
}

/* What a value must be if the comment begins with an interval: "(0, 2]", "[2, 1e6] even". */
struct Interval {
  double low = 0.0, high = 1e9;
  bool open = true;    // at its lower end
  std::string text = "(0, 1e9]", kind;

  bool read(const std::string &comment)
  {
    const auto comma = comment.find(", "), end = comment.find(']');
    if ((comment[0] != '(' && comment[0] != '[') || comma > end || end == std::string::npos)
      return false;
    if (!number(comment.substr(1, comma - 1), low) ||
        !number(comment.substr(comma + 2, end - comma - 2), high))
      return false;
    open = comment[0] == '(';
    text = comment.substr(0, end + 1);
    for (const char *word : {"even", "whole"})
      if (comment.compare(end + 1, 1 + std::string(word).size(), std::string(" ") + word) == 0)
        kind = word;
    return true;
  }

  bool holds(const std::string &value) const
  {
    double x;
    if (!number(value, x) || x < low || x > high || (open && x == low)) return false;
    if (kind.empty()) return true;
    return digits_alone(value) && (kind == "whole" || (value.back() - '0') % 2 == 0);
  }

  std::string words(const std::string &value) const
  {
    if (kind.empty()) return "a number in " + text;
    double x;
    const bool point = number(value, x) && !digits_alone(value);    // or exponent
    return (kind == "even" ? "an even number in " : "a whole number in ") + text +
           (point ? ", in digits" : "");
  }
};

/* The words of "cg | fire: what they do"; none if the comment begins otherwise. */
std::vector<std::string> choices(const std::string &comment)
{
  std::istringstream rest(comment);
  std::vector<std::string> found;
  for (std::string word, bar; rest >> word;) {
    const bool last = word.back() == ':' || word.back() == ';' || word.back() == ',';
    found.push_back(last ? word.substr(0, word.size() - 1) : word);
    if (last || !(rest >> bar) || bar != "|") break;
  }
  if (found.size() < 2) found.clear();
  return found;
}

/* Letters to change, insert, leave out or exchange with the next: Damerau and Levenshtein. */
size_t distance(const std::string &a, const std::string &b)
{
  std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); i++)
    for (size_t j = 0; j <= b.size(); j++) {
      if (!i || !j) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] =
          std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

std::string lower_case(std::string text)
{
  for (char &c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/* Names that the deck sets itself, or that are no one's to change. */
bool internal(const std::string &name)
{
  return name == "model" || name == "quote" || name == "strict";
}

}    // namespace

bool LAMMPS_NS::reads_variable(const std::string &value, const std::string &name)
{
  if (value.find("${" + name + "}") != value.npos) return true;
  for (auto at = value.find(name); at != value.npos; at = value.find(name, at + 1)) {
    const char after = at + name.size() < value.size() ? value[at + name.size()] : ' ';
    const bool formula = at > 1 && value.compare(at - 2, 2, "v_") == 0 && !of_name(after);
    if (formula || (after == '=' && (at == 0 || value[at - 1] == ' '))) return true;
  }
  return false;
}

void DeckText::read_line(const std::string &line)
{
  static constexpr char OPTIONAL[] = "# optional: ";
  if (line.rfind(OPTIONAL, 0) == 0) {
    std::istringstream names(line.substr(sizeof(OPTIONAL) - 1));
    for (std::string name; names >> name;) optional.insert(name);
    return;
  }
  const auto hash = line.find('#');
  std::istringstream words(line.substr(0, hash));
  std::string command, name, style, default_value;
  if (line.compare(0, 8, "variable") == 0 && words >> command >> name >> style >> default_value &&
      style == "index") {
    const auto start = hash == std::string::npos ? hash : line.find_first_not_of(" #", hash);
    given.insert({name, {default_value, start == std::string::npos ? "" : line.substr(start)}});
  } else
    for (auto at = line.find("variable "); at < hash; at = line.find("variable ", at + 1)) {
      const auto start = line.find_first_not_of(' ', at + 9);
      const std::string found = start < hash ? name_at(line, start) : "";
      if (!found.empty()) computed.insert(found);
    }
  for (auto at = line.find("v_"); at < hash; at = line.find("v_", at + 1)) {
    const std::string found = name_at(line, at + 2);
    if (line.compare(at + 2 + found.size(), 2, "${") == 0) families.insert(found);
  }
}

bool DeckText::used(const Given &variable) const
{
  const auto ends = [&text = variable.comment](const std::string &words) {
    return text.size() >= words.size() &&
           text.compare(text.size() - words.size(), words.size(), words) == 0;
  };
  return !(ends("; random start only") && given.count("data")) &&
         !(ends("; dp only") && model != "dp") && !(ends("; sp only") && model == "dp");
}

void DeckText::read(const std::string &text, const Value &value)
{
  std::istringstream lines(text);
  std::vector<std::string> parts;
  for (std::string line; std::getline(lines, line);) {
    read_line(line);
    const auto from = line.find("include \"${dir}/"), end = line.find('"', from + 9);
    if (from < line.find('#') && end != std::string::npos)
      parts.push_back(line.substr(from + 9, end - from - 9));
  }
  if (const auto found = given.find("model"); found != given.end())
    model = found->second.default_value;
  for (std::string part : parts) {
    for (const char *name : {"dir", "model"}) {
      const std::string word = std::string("${") + name + "}";
      const auto at = part.find(word);
      if (at == std::string::npos) continue;
      const auto found = given.find(name);
      std::string words = value(name);
      if (words.empty() && found != given.end()) words = found->second.default_value;
      part.replace(at, word.size(), words);
    }
    std::ifstream file(part);
    std::stringstream content;
    content << file.rdbuf();
    if (content.str() != text) read(content.str(), value);
  }
}

bool DeckText::takes(const std::string &name) const
{
  if (const auto found = given.find(name); found != given.end()) return used(found->second);
  if (optional.count(name)) return true;
  for (const std::string &family : families)
    if (name.size() > family.size() && name.compare(0, family.size(), family) == 0 &&
        digits_alone(name.substr(family.size())))
      return true;
  return false;
}

bool DeckText::computes(const std::string &name) const
{
  return computed.count(name) && !given.count(name) && !takes(name);
}

std::string DeckText::must_be(const std::string &name, const std::string &value) const
{
  const auto found = given.find(name);
  if (found == given.end()) return "";
  const auto &[default_value, comment] = found->second;
  if (comment.rfind("file: ", 0) == 0)
    return std::ifstream(value) ? ""
                                : "a file that exists: start in the folder of this input, or give "
                                  "-var " + name + " FILE";
  if (const auto words = choices(comment); !words.empty()) {
    if (std::find(words.begin(), words.end(), value) != words.end()) return "";
    return std::accumulate(words.begin() + 1, words.end(), "one of " + words[0],
                           [](const std::string &a, const std::string &b) {
                             return a + " | " + b;
                           });
  }
  Interval interval;
  if (!interval.read(comment)) {
    double number_or_not = 0.0;
    if (!number(default_value, number_or_not) && default_value.compare(0, 2, "$(") != 0)
      return name == "dir" || value.find_first_of(" \t\"'$&#") == value.npos
                 ? ""
                 : "a name without spaces and quotes, which LAMMPS takes";
    interval.open = number_or_not != 0.0 || default_value[0] == '$';
    interval.text = interval.open ? "(0, 1e9]" : "[0, 1e9]";
  }
  return interval.holds(value) ? "" : interval.words(value);
}

std::string DeckText::offered() const
{
  std::string names;
  for (const auto &each : given)
    if (!internal(each.first) && used(each.second))
      names += (names.empty() ? "" : ", ") + each.first;
  return names;
}

std::string DeckText::meant(const std::string &misspelt) const
{
  const std::string name = lower_case(misspelt);
  std::string best;
  size_t least = 1 + (name.size() + 1) / 3;    // letters that may be wrong, and one more
  for (const auto &each : given) {
    const std::string &known = each.first;
    if (internal(known) || !used(each.second)) continue;
    const bool part =
        name.size() > 2 && known.size() > 2 &&
        (known.find(name) != std::string::npos || name.find(known) != std::string::npos);
    const size_t away = part ? 1 : distance(name, known);
    if (away >= least) continue;
    least = away;
    best = known;
  }
  return best.empty() ? "it has " + offered() : "give " + best;
}
