#include "droplet_outlines.h"

namespace jamlab {

namespace {

constexpr double PI = 3.141592653589793238, NEVER = INFINITY;
constexpr double MARGIN = 1e-6;  // of the rim, beyond which edges are not looked at

// Returns where the lines of two edges, both moved outwards by w, cross: how far from the tail of
// the first, in the direction of the first. `tail`: from the tail of the first to the other one.
double crossing_of_first(const RimEdge &one, const RimEdge &other, const Vector &tail, double w)
{
  const double sine = cross(one.along, other.along), cosine = dot(one.along, other.along);
  const double lost = cosine > 0 ? sine * sine / (1 + cosine) : 1 - cosine;
  return (w * lost + dot(other.normal, tail)) / sine;
}

// The same seen from either edge: the earlier one decides.
double crossing(const RimEdge &a, const RimEdge &b, const NearEdge &near, double w)
{
  if (near.later) return crossing_of_first(a, b, near.tail, w);
  const double place = crossing_of_first(b, a, near.tail * -1.0, w);
  return dot(near.tail + b.along * place + b.normal * w, a.along);
}

// Returns whether the line of a, moved outwards, lies below that of a parallel edge.
bool lies_below(const RimEdge &a, const RimEdge &b, const NearEdge &near, double w)
{
  if (dot(a.along, b.along) < 0)  // they face each other
    return (near.later ? dot(a.normal, near.tail) : -dot(b.normal, near.tail)) < 2 * w;
  // of lines that coincide, the earlier lies above
  return near.later ? dot(a.normal, near.tail) > 0 : dot(b.normal, near.tail) >= 0;
}

// The part of the line of edge a, moved outwards, in the capsule around edge b.
bool cut_line(const RimEdge &a, const RimEdge &b, const NearEdge &near, double w, double rounding,
              double &low, double &high)
{
  const Vector u = a.along, v = b.along;
  low = NEVER;
  high = -NEVER;
  const Vector ends[2] = {near.tail, near.head};
  double above[2];
  for (int k = 0; k < 2; ++k) {
    above[k] = cross(ends[k], u);
    const double square = above[k] * (2 * w - above[k]);
    if (!(square > 0)) continue;
    const double half = std::sqrt(square), place = dot(ends[k], u);
    low = std::min(low, place - half);
    high = std::max(high, place + half);
  }
  if (std::max(above[0], above[1]) < -rounding) return false;
  if (std::min(above[0], above[1]) > 2 * w + rounding) return false;
  const Vector start = a.normal * w - near.tail;
  double enter = -NEVER, leave = NEVER;
  const double sine = cross(u, v), cosine = dot(u, v), along = dot(start, v);
  if (sine != 0) {
    const double outer = crossing(a, b, near, w), inner = outer - 2 * w / sine;
    enter = std::min(outer, inner);
    leave = std::max(outer, inner);
  } else if (!lies_below(a, b, near, w) || !(dot(start, b.normal) > -w)) {
    return low < high;
  }
  if (cosine != 0) {
    const double one = -along / cosine, two = (b.length - along) / cosine;
    enter = std::max(enter, std::min(one, two));
    leave = std::min(leave, std::max(one, two));
  } else if (!(0 < along && along < b.length)) {
    return low < high;
  }
  if (enter < leave) {
    low = std::min(low, enter);
    high = std::max(high, leave);
  }
  return low < high;
}

// Returns whether an arc, from one direction to another less than half a turn ahead, surely lies
// outside of an interval of directions.
bool surely_outside(const Vector &start, const Vector &stop, const Vector &begin, const Vector &end)
{
  const double margin = 1e-9;  // far above rounding
  for (const Vector &one : {begin, end})
    if (cross(start, one) > -margin && cross(one, stop) > -margin) return false;
  if (cross(begin, end) > 0) return !(cross(begin, start) > 0 && cross(start, end) > 0);
  return cross(start, begin) > 0 && cross(end, start) > 0;
}

// The part of the arc around the tail of an edge, between the directions `start` and `stop`, in the
// capsule around edge b: its width and where it begins, from 0 to 2 pi, counted from `start`.
//
// In the frame of the capsule, x along it and y >= 0 the distance of the centre from its line,
// directions are counted from the one straight at the line, (sine, cosine): the circle crosses the
// near side y = w of the capsule at +-beta, cos(beta) = y/w - 1, if it does so between its ends,
// else it crosses the disk around that end.
bool cut_arc(const Vector &start, const Vector &stop, const RimEdge &b, const NearEdge &near,
             double w, double &begin, double &width)
{
  const Vector v = b.along;
  const double x = -dot(near.tail, v), across = cross(near.tail, v), y = std::fabs(across);
  const double to_tail = size(near.tail), to_head = size(near.head);
  const double distance = x < 0 ? to_tail : x > b.length ? to_head : y;
  if (!(distance < 2 * w)) return false;
  const double side = across >= 0 ? 1.0 : -1.0;
  const double half = std::sqrt(std::max(y * (2 * w - y), 0.0));
  const Vector down = Vector{v.y, -v.x} * side;
  Vector directions[2];
  for (int k = 0; k < 2; ++k) {
    const double sign = k ? side : -side, place = x + sign * half;
    double along = sign * half / w, toward = (y - w) / w;
    if (!(place >= 0 && place <= b.length)) {
      const Vector &end = place > b.length ? near.head : near.tail;
      const double apart = place > b.length ? to_head : to_tail;
      const double tx = apart > 0 ? dot(end, v) / apart : 0.0;
      const double ty = apart > 0 ? dot(end, down) / apart : 1.0;
      const double c = std::min(0.5 * apart / w, 1.0), s = sign * std::sqrt((1 - c) * (1 + c));
      along = tx * c + ty * s;
      toward = ty * c - tx * s;
    }
    directions[k] = v * along + down * toward;
  }
  if (surely_outside(start, stop, directions[0], directions[1])) return false;
  double ends[2];
  for (int k = 0; k < 2; ++k)
    ends[k] = std::atan2(cross(start, directions[k]), dot(start, directions[k]));
  // it spans more than 2 pi/3 from nearer than w/2, and less than 4 pi/3 from further away
  width = ends[1] - ends[0];
  if (width < (distance < 0.5 * w ? 1.0 : -1.0)) width += 2 * PI;
  begin = ends[0] < 0 ? ends[0] + 2 * PI : ends[0];
  return true;
}

}  // namespace

// neighbors -----------------------------------------------------------------------------------

DropletOutlines::DropletOutlines(int64_t n, const int64_t *offsets, const double *x,
                                 const double *box, double rim)
  : EdgeRings(n, offsets, x),
    w(rim),
    lattice(box),
    rounding(rounding_of_distance(largest_coordinate(offsets[n], x) + lattice.longest))
{}

int64_t DropletOutlines::find_near(double most_copies, double *search)
{
  found.clear();
  found.reserve(2 * edges.size());
  entangled.assign(n, {});
  std::vector<int64_t> who;
  std::vector<double> middles, reach;
  for (int64_t p = 0; p < n; ++p) {
    if (first[p] == first[p + 1]) continue;
    const Bounds &bounds = around[p];
    who.push_back(p);
    middles.push_back(0.5 * (bounds.low.x + bounds.high.x));
    middles.push_back(0.5 * (bounds.low.y + bounds.high.y));
    reach.push_back(0.5 * size(bounds.high - bounds.low) + w * (1 + MARGIN) + rounding);
    if (dented[p]) join(p, p, {0, 0});
  }
  const int64_t m = static_cast<int64_t>(who.size());
  if (m) {
    const Reaching all{m, middles.data(), reach.data()};
    const int64_t refusal = visit_neighbors(
        all, all, lattice, true, most_copies, search,
        [&](const Neighbor &pair) { join(who[pair.i], who[pair.j], pair.shift); });
    if (refusal < 0) return refusal;
  }
  sort_by_edge();
  return 0;
}

// Lists the edges of a polygon near a place, by where they begin along the x or the y axis.
void DropletOutlines::collect(int64_t particle, const Bounds &place, bool upright,
                              std::vector<Extent> &list) const
{
  list.clear();
  for (int64_t e = first[particle]; e < first[particle + 1]; ++e) {
    const Vector &a = edges[e].tail, &b = edges[edges[e].after].tail;
    const Bounds own{{std::min(a.x, b.x), std::min(a.y, b.y)},
                     {std::max(a.x, b.x), std::max(a.y, b.y)}};
    if (!own.meets(place)) continue;
    list.push_back(upright ? Extent{own.low.y, own.high.y, e} : Extent{own.low.x, own.high.x, e});
  }
  std::sort(list.begin(), list.end(),
            [](const Extent &a, const Extent &b) { return a.low < b.low; });
}

// Finds the pairs of edges of two polygons, or of one, that are near each other.
void DropletOutlines::join(int64_t p, int64_t q, const Image &shift)
{
  const Vector move = lattice.translation(shift);
  const double limit = 2 * w * (1 + MARGIN) + rounding;
  const Bounds of_p = around[p], of_q = around[q].moved(move);
  if (!of_p.wider(limit).meets(of_q)) return;
  const Bounds both = of_p.wider(limit).common(of_q.wider(limit));
  const Vector extent = both.high - both.low;
  const bool one = p == q && shift.home(), upright = extent.y > extent.x;
  collect(p, both, upright, near_p);
  collect(q, both.moved(move * -1.0), upright, near_q);
  const double along = upright ? move.y : move.x;
  std::size_t begin = 0;
  double longest = 0.0;
  for (const Extent &b : near_q) longest = std::max(longest, b.high - b.low);
  for (const Extent &a : near_p) {
    while (begin < near_q.size() && near_q[begin].low + along < a.low - limit - longest) ++begin;
    for (std::size_t k = begin; k < near_q.size() && near_q[k].low + along <= a.high + limit; ++k)
      if (!one || a.edge < near_q[k].edge) add_pair(a.edge, near_q[k].edge, shift, move, one);
  }
  if (!one && ((of_q.holds(of_p, rounding) && holds(q, home(p) - move)) ||
               (of_p.holds(of_q, rounding) && holds(p, home(q) + move))))
    note(INSIDE, p, q, shift);
}

void DropletOutlines::add_pair(int64_t i, int64_t j, const Image &shift, const Vector &move,
                               bool own)
{
  const RimEdge &a = edges[i], &b = edges[j];
  const Vector tail = b.tail - a.tail + move, head = edges[b.after].tail - a.tail + move;
  const double limit = 2 * w * (1 + MARGIN);
  const auto both_beyond = [&](double one, double two, double low, double high) {
    return std::max(one, two) < low || std::min(one, two) > high;
  };
  if (both_beyond(cross(tail, a.along), cross(head, a.along), -limit, limit)) return;
  if (both_beyond(dot(tail, a.along), dot(head, a.along), -limit, a.length + limit)) return;
  if (!own) {
    const Meeting how = judge_edges(a, b, tail, head, rounding);
    if (how != APART) note(how, a.particle, b.particle, shift);
  }
  found.push_back({i, j, shift, own});
}

void DropletOutlines::note(Meeting how, int64_t i, int64_t j, const Image &shift)
{
  const NearPolygon one{j, shift}, other{i, Image{0, 0} - shift};
  const auto add = [](std::vector<NearPolygon> &list, const NearPolygon &polygon) {
    if (std::find(list.begin(), list.end(), polygon) == list.end()) list.push_back(polygon);
  };
  add(entangled[i], one);
  add(entangled[j], other);
  const int64_t low = std::min(i, j), high = std::max(i, j);
  if (how < meeting) return;
  if (how == meeting && std::make_pair(met[0], met[1]) <= std::make_pair(low, high)) return;
  meeting = how;
  met[0] = low;
  met[1] = high;
}

bool DropletOutlines::holds(int64_t particle, const Vector &place) const
{
  bool inside = false;
  for (int64_t e = first[particle]; e < first[particle + 1]; ++e) {
    const Vector a = edges[e].tail - place, b = edges[edges[e].after].tail - place;
    if ((a.y > 0) == (b.y > 0)) continue;
    if ((cross(a, b) > 0) == (b.y > a.y)) inside = !inside;
  }
  return inside;
}

// Lists each pair beside both of its edges.
void DropletOutlines::sort_by_edge()
{
  near_first.assign(edges.size() + 1, 0);
  for (const Found &one : found) {
    ++near_first[one.i + 1];
    ++near_first[one.j + 1];
  }
  std::partial_sum(near_first.begin(), near_first.end(), near_first.begin());
  std::vector<int64_t> next(near_first.begin(), near_first.end() - 1);
  near.resize(2 * found.size());
  for (const Found &one : found) {
    const RimEdge &a = edges[one.i], &b = edges[one.j];
    const Vector move = lattice.translation(one.shift), tail = b.tail - a.tail + move;
    const Vector to_b = head(b) - a.tail + move, to_a = head(a) - b.tail - move;
    near[next[one.i]++] = {one.j, one.shift, tail, to_b, one.own, true};
    near[next[one.j]++] = {one.i, Image{0, 0} - one.shift, tail * -1.0, to_a, one.own, false};
  }
}

// parts of elements -------------------------------------------------------------------------------

void OutlineCutter::collect_along(int64_t edge)
{
  const RimEdge &a = outlines.edges[edge];
  found.clear();
  for (int64_t k = outlines.near_first[edge]; k < outlines.near_first[edge + 1]; ++k) {
    const NearEdge &near = outlines.near[k];
    const RimEdge &b = outlines.edges[near.j];
    // neighbors on one polygon hide each other only at reflex corners
    const bool convex_after = near.j == a.after && b.turn >= 0;
    const bool convex_before = near.j == a.before && a.turn >= 0;
    if (near.own && (convex_after || convex_before)) continue;
    double low, high;
    if (cut_line(a, b, near, outlines.w, outlines.rounding, low, high))
      found.push_back({{b.particle, near.shift}, near.own, low, high});
  }
}

void OutlineCutter::collect_around(int64_t edge)
{
  const RimEdge &a = outlines.edges[edge];
  const Vector &start = outlines.edges[a.before].normal;
  found.clear();
  for (int64_t k = outlines.near_first[edge]; k < outlines.near_first[edge + 1]; ++k) {
    const NearEdge &near = outlines.near[k];
    if (near.own && near.j == a.before) continue;
    double begin, width;
    const RimEdge &b = outlines.edges[near.j];
    if (!cut_arc(start, a.normal, b, near, outlines.w, begin, width)) continue;
    const NearPolygon by{b.particle, near.shift};
    found.push_back({by, near.own, begin, begin + width});
    found.push_back({by, near.own, begin - 2 * PI, begin - 2 * PI + width});
  }
}

// The bare edge is an edge that lies 2 w further inside, moved outwards by 2 w.
void OutlineCutter::collect_contacts(int64_t edge)
{
  const RimEdge &a = outlines.edges[edge];
  const double reach = 2 * outlines.w;
  found.clear();
  for (int64_t k = outlines.near_first[edge]; k < outlines.near_first[edge + 1]; ++k) {
    NearEdge near = outlines.near[k];
    if (near.own) continue;
    near.tail += a.normal * reach;
    near.head += a.normal * reach;
    const RimEdge &b = outlines.edges[near.j];
    double low, high;
    if (cut_line(a, b, near, reach, outlines.rounding, low, high))
      found.push_back({{b.particle, near.shift}, false, low, high});
  }
}

// Unites the intervals of each polygon, within the element.
void OutlineCutter::unite(double extent)
{
  merged.clear();
  for (Interval &one : found) {
    one.low = std::max(one.low, 0.0);
    one.high = std::min(one.high, extent);
  }
  if (found.size() > 1)
    std::sort(found.begin(), found.end(), [](const Interval &a, const Interval &b) {
      if (a.own != b.own) return a.own;
      if (!(a.by == b.by)) return a.by < b.by;
      return a.low < b.low;
    });
  for (const Interval &one : found) {
    if (!(one.low < one.high)) continue;
    if (merged.size() && merged.back().same(one) && one.low <= merged.back().high)
      merged.back().high = std::max(merged.back().high, one.high);
    else
      merged.push_back(one);
  }
}

void OutlineCutter::merge(int64_t edge, bool arc, double extent)
{
  unite(extent);
  if (!outlines.entangled[outlines.edges[edge].particle].empty()) fill_insides(edge, arc, extent);
  sort_ends(extent);
}

// Fills the gaps between the capsules of a polygon where they lie inside it.
void OutlineCutter::fill_insides(int64_t edge, bool arc, double extent)
{
  const RimEdge &e = outlines.edges[edge];
  const Vector normal = outlines.edges[e.before].normal;
  const auto at = [&](double place) {
    if (!arc) return e.tail + e.normal * outlines.w + e.along * place;
    const double c = std::cos(place), s = std::sin(place);
    return e.tail + Vector{normal.x * c - normal.y * s, normal.x * s + normal.y * c} * outlines.w;
  };
  for (const NearPolygon &by : outlines.entangled[e.particle]) {
    const Vector shift = outlines.translation(by.shift);
    std::vector<Interval> whole;
    double reached = 0.0;
    const auto fill = [&](double low, double high) {
      const Vector middle = at(0.5 * (reached + low)) - shift;
      const bool inside = reached < low && outlines.holds(by.particle, middle);
      const double begin = inside || !(reached < low) ? reached : low;
      if (whole.size() && begin == whole.back().high)
        whole.back().high = high;
      else if (begin < high)
        whole.push_back({by, false, begin, high});
      reached = high;
    };
    const auto of_polygon = [&](const Interval &one) { return !one.own && one.by == by; };
    for (const Interval &one : merged)
      if (of_polygon(one)) fill(one.low, one.high);
    if (reached < extent) fill(extent, extent);
    merged.erase(std::remove_if(merged.begin(), merged.end(), of_polygon), merged.end());
    merged.insert(merged.end(), whole.begin(), whole.end());
  }
}

void OutlineCutter::sort_ends(double extent)
{
  ends.clear();
  for (std::size_t k = 0; k < merged.size(); ++k) {
    ends.push_back({merged[k].low, static_cast<int64_t>(k), true});
    if (merged[k].high < extent) ends.push_back({merged[k].high, static_cast<int64_t>(k), false});
  }
  if (ends.size() > 1)
    std::sort(ends.begin(), ends.end(),
              [](const End &a, const End &b) { return a.place < b.place; });
}

}  // namespace jamlab
