# awk -f settings.awk DIR DECK HIDDEN: what `lmp -var` set, against the deck, its parts and the data file it reads.
# A setting is a line `variable NAME index DEFAULT # [RULE] ...` of the deck or of a part that it includes, if something
# there uses it. HIDDEN.given is LAMMPS' list of the variables and commands that exist. Prints LAMMPS commands: the
# values that the data file carries, or what is refused and `quit 1`.
BEGIN {
  dir = ARGV[1]; deck = ARGV[2]; out = ARGV[3]
  read(deck)
  while ((getline line < (out ".given")) > 0) {
    if (line ~ /jamlab\/quiet/) plugin = 1
    if (line ~ /^Variable\[/) {
      name = line; sub(/^[^:]*: */, "", name); sub(/,.*/, "", name)
      value = line; sub(/.*def = /, "", value)
      given[name] = value
    } else if (split(line, word) > 1 && word[1] == "Value:") given[word[2]] = substr(line, length(word[2]) + 9)
  }
  for (name in given) check(name, given[name])
  if ("data" in rule) data_file(value_of("data"))
  if ("ntypes" in rule) {
    for (k = value_of("ntypes"); k > 2; k--)
      if (!(("d" k) in given || ("d" k) in carried)) refuse("ntypes = " value_of("ntypes") ", but there is no d" k)
    for (name in given)
      if (name ~ /^d[1-9][0-9]*$/ && substr(name, 2) + 0 > value_of("ntypes") + 0)
        refuse("-var " name ": there are only ntypes = " value_of("ntypes") " sizes")
  }
  for (k = 1; k <= 2; k++) {
    strength = k == 1 ? "eps" : "k"
    if ((strength in given) && ("law" in rule) && value_of("law") != strength && value_of("law") ~ /^(eps|k)$/)
      refuse(strength " = " given[strength] ": has no effect with law " value_of("law"))
  }
  if (used("small_polygon")) { polygon("small"); polygon("large") }
  if (refused) { print "shell rm -f " out ".parts " out ".given " out ".settings\nquit 1"; exit }
  print "variable quiet string \"" (plugin && value_of("screen") == "table" ? "jamlab/quiet" : "") "\""
}

function value_of(name) { return name in given ? given[name] : name in carried ? carried[name] : standard[name] }

function refuse(text) { gsub(/["$]/, "'", text); print "print \"REFUSED: " text "\""; refused = 1 }

function polygon(size,    corners, path, line) {   # a template in quotes, since its folder may hold spaces
  corners = value_of("nv_" size); path = dir "/polygon" corners ".mol"
  if ((getline line < path) < 0) refuse("nv_" size " = " corners ": there is no " path)
  else print "variable " size "_polygon index \"'" path "'\""
}

function read(part,    line, comment, word, at) {   # settings of a part and of those it includes, the first one counts
  if (part in seen) return
  seen[part] = 1
  while ((getline line < (dir "/" part)) > 0) {
    comment = ""
    if (at = index(line, "#")) { comment = substr(line, at + 1); line = substr(line, 1, at - 1) }
    if (split(line, word) >= 4 && word[1] == "variable" && word[3] == "index") {
      if (!(word[2] in rule) && match(comment, /\[[^]]*\]/)) {
        order[++count] = word[2]; standard[word[2]] = word[4]; rule[word[2]] = substr(comment, RSTART + 1, RLENGTH - 2)
      }
      sub(/^ *variable +[^ ]+ +index/, "", line)
    }
    text = text line "\n"
    while (match(line, /[$][{]dir[}]\/[a-z_.]+/)) {
      at = RSTART + RLENGTH
      read(substr(line, RSTART + 7, RLENGTH - 7))
      line = substr(line, at)
    }
  }
  close(dir "/" part)
}

function used(name) { return text ~ ("[$][{]" name "[}]|v_" name "([^A-Za-z0-9_]|$)") }

function check(name, value,    known, k, problem) {
  if (name ~ /^(dir|deck|out|replica)$/) return
  if (name ~ /^d[1-9][0-9]*$/ && ("d1" in rule)) problem = broken(value, "> 0")
  else if (!(name in rule) || !(used(name) || name == "screen")) {
    for (k = 1; k <= count; k++) if (used(order[k]) && order[k] !~ /^(dir|deck|replica)$/) known = known " " order[k]
    refuse("-var " name ": this deck has no such variable; it takes" known)
    return
  } else problem = broken(value, rule[name])
  if (problem) refuse(name " = " value ": must be " problem)
}

function broken(value, wanted,    part, n, k, limit) {   # the rule, if the value breaks it
  if (wanted == "text") return value ~ /[ \t"$]/ || value ~ /'/ ? "a name without spaces and quotes" : ""
  if (index(wanted, "|")) {
    n = split(wanted, part, / *[|] */)
    for (k = 1; k <= n; k++) if (value == part[k]) return ""
    return "one of " wanted
  }
  if (value !~ /^[-+]?([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][-+]?[0-9]+)?$/) return "a number, " wanted
  n = split(wanted, part, / *, */)
  for (k = 1; k <= n; k++) {
    limit = part[k]; sub(/^[<>=]+ */, "", limit)
    if (part[k] ~ /^(whole|even)$/ && value !~ /^[0-9]+$/) return wanted
    if (part[k] == "even" && value % 2) return wanted
    if (part[k] ~ /^>=/ && value + 0 < limit + 0 || part[k] ~ /^> / && value + 0 <= limit + 0) return wanted
    if (part[k] ~ /^<=/ && value + 0 > limit + 0 || part[k] ~ /^< / && value + 0 >= limit + 0) return wanted
  }
  return ""
}

function differ(a, b) {   # texts as they are, numbers but for the digits that LAMMPS drops
  if (a !~ /^[-+.0-9]/ || b !~ /^[-+.0-9]/) return a != b
  return (a - b) ^ 2 > (1e-12 * a) ^ 2
}

function own_sizes(file,    line, word, section, class, diameter, id, k, largest, text, classes, squares) {
  close(file)   # types are classes of size: the largest disk of each says how far it may reach
  while ((getline line < file) > 0) {
    if (line ~ /^[A-Za-z]/) { section = line; sub(/ .*/, "", section) }
    else if (split(line, word) < 2) continue
    else if (section == "Atoms") class[word[1]] = word[2]
    else if (section == "d_diameter") diameter[word[1]] = word[2]
  }
  for (id in diameter) {
    k = class[id]; squares += diameter[id] ^ 2
    if (k > classes) classes = k
    if (diameter[id] + 0 > largest[k]) { largest[k] = diameter[id] + 0; text[k] = diameter[id] }
  }
  for (k = 1; k <= classes; k++) {
    carried["d" k] = text[k]
    print "variable d" k " index " text[k]
  }
  carried["ntypes"] = classes
  for (k in given) if (k ~ /^(ratio|ntypes|d[1-9][0-9]*)$/) refuse(k " = " given[k] ": each disk of " file " has its own diameter")
  if (!plugin) refuse(file " has a diameter for each disk, which takes pair style disk/drag of the plugin of jamlab")
  printf "variable ntypes index %d\nvariable squares index %.17g\n", classes, squares
}

function data_file(file,    atoms, line, status, found, own, word, n, k, at, name, value, sizes, list) {
  while ((status = (getline line < file)) > 0) {
    if (line ~ /^# jamlab /) found = line
    if (line ~ /^d_diameter/) own = 1
    if (line ~ /^ *[0-9]+ +atoms/) atoms = 1
  }
  if (own) own_sizes(file)
  if (status < 0) { refuse("data = " file ": there is no such file"); return }
  if (!found && !atoms && file !~ /[.](gz|bz2|zst|xz|lzma|lz4)$/) {
    refuse("data = " file ": is no data file of LAMMPS (no line `N atoms`): give one of jamlab.write_data or of another deck")
    return
  }
  if (!found) {
    print "print \"" file " does not say its law (no line `# jamlab ...`): the values of this run are taken\""
    return
  }
  n = split(found, word)
  for (k = 3; k <= n; k++) {
    at = index(word[k], "="); name = substr(word[k], 1, at - 1); value = substr(word[k], at + 1)
    if (name == "units" && ("law" in rule)) name = "law"
    if (name == "model" && value != substr(deck, 4, 2))
      refuse(file " holds " value ", this deck takes " substr(deck, 4, 2))
    if (name == "converged" && value == 0 && !("minimum" in seen || "minimize." in seen))
      print "print \"NOT A MINIMUM, or not known to be one: " file " says converged=0\""
    if (name ~ /^d[1-9][0-9]*$/) { sizes++; list = list " " word[k] }
    else if (!(name in rule)) continue
    carried[name] = value
    if (!(name in given)) print "variable " name " index " value
    else if (differ(given[name], value))
      refuse(name " = " given[name] ", but " file " was made with " name " = " value)
  }
  if (sizes) {
    carried["ntypes"] = sizes
    print "variable sizes index \"" list "\""
    if (!("ntypes" in given)) print "variable ntypes index " sizes
    else if (given["ntypes"] != sizes) refuse("ntypes = " given["ntypes"] ", but " file " has " sizes " sizes")
    if ("ratio" in given) {
      value = sizes == 2 ? carried["d2"] / carried["d1"] : "none"
      if (differ(given["ratio"], value))
        refuse("ratio = " given["ratio"] ", but " file " was made with ratio = " value)
    }
  }
  if (!refused) print "print \"" file ": " substr(found, 10) "\""
}
