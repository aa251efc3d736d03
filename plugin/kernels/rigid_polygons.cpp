#include "rigid_polygons.h"

#include "nearest_foot.h"
#include "periodic_neighbors.h"

using namespace jamlab;

namespace {

constexpr double TWO_PI = 6.283185307179586477;
constexpr double SKIN = 0.3;        // extra reach of the list of pairs, mean diameter
constexpr double TOUCHING = 1e-12;  // distance over delta below which a contact has no direction
constexpr double MOST_COPIES = 1e8;

int64_t after(int64_t k, int64_t count) { return k + 1 < count ? k + 1 : 0; }
int64_t ahead(int64_t k, int64_t count) { return k > 0 ? k - 1 : count - 1; }

}  // namespace

RigidPolygons::RigidPolygons(int64_t n, const int64_t *counts, const double *radii_, double eps,
                             double delta, const double *box, const double *coordinates,
                             bool shears) :
    n(n), shears(shears), eps(eps), delta(delta), first(n + 1, 0), radii(radii_, radii_ + n)
{
  q.assign(coordinates, coordinates + 3 * n);
  width = box[0];
  tilt = box[2];
  height = box[3];
  for (int64_t i = 0; i < n; ++i) {
    first[i + 1] = first[i] + counts[i];
    for (int64_t k = 0; k < counts[i]; ++k) {
      const double angle = TWO_PI * k / counts[i];
      resting.push_back(Vector{std::cos(angle), std::sin(angle)} * radii[i]);
    }
  }
  spokes.resize(resting.size());
  forces.resize(3 * (n + shears));
}

bool RigidPolygons::list_holds() const
{
  if (listed.q.empty()) return false;
  const double xx = width / listed.width, yy = height / listed.height;
  const double xy = (tilt - yy * listed.tilt) / listed.height;
  double square = 0.0;
  for (int64_t i = 0; i < n; ++i) {
    const auto [x, y] = listed.centre(i);
    const Vector moved = centre(i) - Vector{xx * x, 0.0} - Vector{xy * y, yy * y};
    square = std::max(square, dot(moved, moved));
  }
  const double strain = std::max(std::fabs(xx - 1), std::fabs(yy - 1)) + std::fabs(xy);
  const double reach = 2 * *std::max_element(radii.begin(), radii.end()) + delta + SKIN;
  return 2 * std::sqrt(square) + strain * reach < SKIN;
}

void RigidPolygons::list_pairs()
{
  std::vector<double> centres(2 * n), reach(n);
  for (int64_t i = 0; i < n; ++i) {
    put(centres.data(), i, centre(i));
    reach[i] = radii[i] + 0.5 * (delta + SKIN);
  }
  const double box[4] = {width, 0.0, tilt, height};
  double search[5];
  const Reaching all{n, centres.data(), reach.data()};
  pairs.clear();
  const auto list = [&](const Neighbor &found) {
    pairs.push_back({found.i, found.j, found.shift});
  };
  crossed = visit_neighbors(all, all, Lattice(box), true, MOST_COPIES, search, list) != 0;
  listed.q = q;
  listed.width = width;
  listed.tilt = tilt;
  listed.height = height;
}

void RigidPolygons::turn_spokes()
{
  for (int64_t i = 0; i < n; ++i) {
    const double angle = q[3 * i + 2] / radii[i], c = std::cos(angle), s = std::sin(angle);
    for (int64_t v = first[i]; v < first[i + 1]; ++v)
      spokes[v] = {c * resting[v].x - s * resting[v].y, s * resting[v].x + c * resting[v].y};
  }
}

// The distance to the centre of another polygon falls towards the nearest vertex from both sides.
int64_t RigidPolygons::nearest_vertex(int64_t i, const Vector &from, int64_t v) const
{
  const int64_t count = first[i + 1] - first[i];
  const auto square = [&](int64_t k) {
    const Vector point = from + spokes[first[i] + k];
    return dot(point, point);
  };
  double least = square(v);
  for (const auto next : {after, ahead})
    for (int64_t k = 0; k < count; ++k) {
      const int64_t w = next(v, count);
      const double other = square(w);
      if (other >= least) break;
      least = other;
      v = w;
    }
  return v;
}

// Finds the edge of polygon j in whose sector a point lies, seen from the centre of j. It is the
// nearest edge.
int64_t RigidPolygons::edge_below(const Vector &point, int64_t j, int64_t edge) const
{
  const int64_t count = first[j + 1] - first[j];
  const Vector *const spoke = &spokes[first[j]];
  for (int64_t k = 0; k < count && cross(spoke[edge], point) < 0; ++k) edge = ahead(edge, count);
  for (int64_t k = 0; k < count && cross(spoke[after(edge, count)], point) >= 0; ++k)
    edge = after(edge, count);
  return edge;
}

// Finds the contact of a point, given from the centre of polygon j, with an edge of j; false beyond
// the reach.
bool RigidPolygons::find_contact(int64_t i, int64_t j, int64_t edge, double reach, RimContact &c)
{
  const int64_t count = first[j + 1] - first[j];
  const Vector tail = spokes[first[j] + edge];
  const Vector along = spokes[first[j] + after(edge, count)] - tail;
  const Foot foot = foot_on_edge(c.point - tail, along);
  c.corner = foot.t <= 0 || foot.t >= 1;
  c.foot = c.point - foot.r;
  c.distance = std::sqrt(foot.rsq);
  if (cross(along, c.point - tail) > 0) crossed = true;
  if (c.distance >= reach || c.distance < TOUCHING * delta) return false;
  c.overlap = delta - c.distance;
  c.normal = foot.r * (1 / c.distance);
  c.slope[0] = c.normal.x;
  c.slope[1] = c.normal.y;
  c.slope[2] = cross(c.arm, c.normal) / radii[i];
  c.slope[3] = -c.normal.x;
  c.slope[4] = -c.normal.y;
  c.slope[5] = -cross(c.foot, c.normal) / radii[j];
  return true;
}

// Vertices in reach follow each other around the nearest one, and so do the edges below them.
void RigidPolygons::find_contacts(Pair &pair, const Vector &apart, bool turned, double reach)
{
  const int64_t i = turned ? pair.j : pair.i, j = turned ? pair.i : pair.j;
  const int64_t count = first[i + 1] - first[i];
  const Vector from = turned ? apart * -1.0 : apart;
  const double far = radii[j] + reach;
  const auto point_of = [&](int64_t v) { return from + spokes[first[i] + v]; };
  const auto in_reach = [&](const Vector &point) { return dot(point, point) < far * far; };
  int64_t v = pair.vertex[turned] = nearest_vertex(i, from, pair.vertex[turned]);
  if (!in_reach(point_of(v))) return;
  for (int64_t k = 1; k < count && in_reach(point_of(ahead(v, count))); ++k) v = ahead(v, count);
  int64_t &edge = pair.edge[turned];
  for (int64_t k = 0; k < count; ++k, v = after(v, count)) {
    RimContact contact;
    contact.point = point_of(v);
    if (!in_reach(contact.point)) break;
    contact.arm = spokes[first[i] + v];
    contact.turned = turned;
    edge = edge_below(contact.point, j, edge);
    if (find_contact(i, j, edge, reach, contact)) contacts.push_back(contact);
  }
}

// Adds the energy of a pair, and its forces.
void RigidPolygons::push(const NearPair &pair)
{
  Vector pushed{0.0, 0.0};  // i, by j
  for (int64_t m = pair.first; m < pair.last; ++m) {
    const RimContact &c = contacts[m];
    if (c.overlap <= 0) continue;
    const double force = spring() * c.overlap;
    energy += 0.5 * force * c.overlap;
    contact_force = std::max(contact_force, force);
    double *const own = &forces[3 * (c.turned ? pair.j : pair.i)];
    double *const other = &forces[3 * (c.turned ? pair.i : pair.j)];
    for (int a = 0; a < 3; ++a) {
      own[a] += force * c.slope[a];
      other[a] += force * c.slope[3 + a];
    }
    pushed += c.normal * (c.turned ? -force : force);
  }
  const Vector &d = pair.apart;
  virial += dot(pushed, d);
  if (!shears) return;
  forces[3 * n] += (pushed.x * d.x - pushed.y * d.y) / box_coordinate();
  forces[3 * n + 1] += pushed.x * d.y / box_coordinate();
}

void RigidPolygons::evaluate(double margin)
{
  energy = virial = contact_force = 0.0;
  crossed = false;
  if (!list_holds()) list_pairs();
  turn_spokes();
  contacts.clear();
  near.clear();
  forces.assign(3 * (n + shears), 0.0);
  const double reach = delta + margin;
  for (Pair &pair : pairs) {
    const auto [along_x, along_y] = pair.shift;
    const Vector moved{along_x * width + along_y * tilt, along_y * height};
    const Vector apart = centre(pair.i) - centre(pair.j) - moved;
    const double far = radii[pair.i] + radii[pair.j] + reach;
    if (dot(apart, apart) >= far * far) continue;
    const int64_t begin = static_cast<int64_t>(contacts.size());
    find_contacts(pair, apart, false, reach);
    find_contacts(pair, apart, true, reach);
    const int64_t end = static_cast<int64_t>(contacts.size());
    if (begin == end) continue;
    near.push_back({pair.i, pair.j, apart, begin, end});
    push(near.back());
  }
}

double RigidPolygons::largest_force() const
{
  double square = 0.0;
  for (std::size_t i = 0; i < forces.size(); i += 3) {
    const Vector force{forces[i], forces[i + 1]};
    square = std::max({square, dot(force, force), forces[i + 2] * forces[i + 2]});
  }
  return std::sqrt(square);
}

void RigidPolygons::scale(double factor)
{
  for (int64_t i = 0; i < n; ++i)
    for (int a = 0; a < 2; ++a) q[3 * i + a] *= factor;
  width *= factor;
  tilt *= factor;
  height *= factor;
}

void RigidPolygons::keep()
{
  std::swap(static_cast<RigidState &>(*this), before);
  q.resize(before.q.size());
}

void RigidPolygons::move(const Numbers &step, double factor)
{
  double stretch = 1.0, shear = 0.0;
  if (shears) {
    stretch = std::exp(factor * step[3 * n] / box_coordinate());
    shear = factor * step[3 * n + 1] / box_coordinate();
  }
  for (int64_t i = 0; i < n; ++i) {
    const auto [x, y] = before.centre(i);
    q[3 * i] = stretch * x + shear * y + factor * step[3 * i];
    q[3 * i + 1] = y / stretch + factor * step[3 * i + 1];
    q[3 * i + 2] = before.q[3 * i + 2] + factor * step[3 * i + 2];
  }
  width = stretch * before.width;
  tilt = stretch * before.tilt + shear * before.height;
  height = before.height / stretch;
}

void RigidPolygons::go_back() { std::swap(static_cast<RigidState &>(*this), before); }
