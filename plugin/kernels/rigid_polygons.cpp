#include "rigid_polygons.h"

#include "periodic_neighbors.h"

using namespace jamlab;

namespace {

constexpr double TWO_PI = 6.283185307179586477;
constexpr double SKIN = 0.3;        // extra reach of the list of pairs, mean diameter
constexpr double TOUCHING = 1e-12;  // distance over delta below which a contact has no direction
constexpr double MOST_COPIES = 1e8;

// These are the derivatives g of a distance d in the coordinates of a vertex's polygon and of the
// other polygon. The second derivatives of the energy are k g g' - f grad grad d.
struct Gradient {
  double of[6];
};

void add_outer(double (&h)[6][6], double factor, const Gradient &g)
{
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) h[a][b] += factor * g.of[a] * g.of[b];
}

Gradient gradient_along(const Vector &direction, const Vector &arm, const Vector &foot,
                        double radius_i, double radius_j)
{
  return {{direction.x, direction.y, cross(arm, direction) / radius_i, -direction.x, -direction.y,
           -cross(foot, direction) / radius_j}};
}

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
  const auto list = [&](const Neighbor &near) { pairs.push_back({near.i, near.j, near.shift}); };
  crossed = visit_neighbors(all, all, Lattice(box), true, MOST_COPIES, search, list) != 0;
  listed = *this;
}

void RigidPolygons::turn_spokes()
{
  for (int64_t i = 0; i < n; ++i) {
    const double angle = q[3 * i + 2] / radii[i], c = std::cos(angle), s = std::sin(angle);
    for (int64_t v = first[i]; v < first[i + 1]; ++v)
      spokes[v] = {c * resting[v].x - s * resting[v].y, s * resting[v].x + c * resting[v].y};
  }
}

// Finds the contact of a point, seen from the centre of polygon j, with the outline of j. The
// nearest edge is the edge of the point's sector.
bool RigidPolygons::find_contact(const Vector &point, int64_t j, Contact &contact)
{
  const int64_t count = first[j + 1] - first[j];
  double sector = (std::atan2(point.y, point.x) - q[3 * j + 2] / radii[j]) * count / TWO_PI;
  sector -= count * std::floor(sector / count);
  const int64_t edge = std::min(static_cast<int64_t>(sector), count - 1);
  const Vector tail = spokes[first[j] + edge], along = spokes[first[j] + (edge + 1) % count] - tail;
  const double part = dot(point - tail, along) / dot(along, along);
  contact.corner = part <= 0 || part >= 1;
  contact.foot = tail + along * std::clamp(part, 0.0, 1.0);
  contact.point = point;
  const Vector gap = point - contact.foot;
  contact.distance = size(gap);
  if (cross(along, point - tail) > 0) crossed = true;
  if (contact.distance >= delta || contact.distance < TOUCHING * delta) return false;
  contact.normal = gap * (1 / contact.distance);
  return true;
}

void RigidPolygons::add_contact(int64_t i, int64_t j, const Contact &c, Stiffness *second,
                                bool turned)
{
  const double overlap = 1 - c.distance / delta, force = eps / delta * overlap;
  const Gradient g = gradient_along(c.normal, c.arm, c.foot, radii[i], radii[j]);
  energy += 0.5 * eps * overlap * overlap;
  contact_force = std::max(contact_force, force);
  for (int a = 0; a < 3; ++a) {
    forces[3 * i + a] += force * g.of[a];
    forces[3 * j + a] += force * g.of[3 + a];
  }
  if (!second) return;

  double h[6][6] = {};
  add_outer(h, eps / (delta * delta), g);
  const double turn = dot(c.normal, c.arm), foot = dot(c.normal, c.foot);
  const double per_i = 1 / radii[i], per_j = 1 / radii[j];
  const Vector across{-c.normal.y, c.normal.x};
  h[2][2] += force * turn * per_i * per_i;
  if (c.corner) {
    add_outer(h, -force / c.distance, gradient_along(across, c.arm, c.foot, radii[i], radii[j]));
    h[5][5] -= force * foot * per_j * per_j;
  } else {
    h[5][5] += force * dot(c.normal, c.point) * per_j * per_j;
    const Vector side = across * per_j;
    const double mixed[5] = {side.x, side.y, turn * per_i * per_j, -side.x, -side.y};
    for (int a = 0; a < 5; ++a) {
      h[a][5] -= force * mixed[a];
      h[5][a] -= force * mixed[a];
    }
  }
  const int own = turned ? 3 : 0, other = 3 - own;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      second->ii[3 * a + b] += h[own + a][own + b];
      second->ij[3 * a + b] += h[own + a][other + b];
      second->jj[3 * a + b] += h[other + a][other + b];
    }
}

void RigidPolygons::evaluate(bool with_stiffness)
{
  energy = virial = contact_force = 0.0;
  crossed = false;
  if (!list_holds()) list_pairs();
  turn_spokes();
  std::fill(forces.begin(), forces.end(), 0.0);
  if (with_stiffness) stiffness.clear();
  for (const Pair &pair : pairs) {
    const auto [along_x, along_y] = pair.shift;
    const Vector moved{along_x * width + along_y * tilt, along_y * height};
    const Vector apart = centre(pair.i) - centre(pair.j) - moved;
    const double far = radii[pair.i] + radii[pair.j] + delta;
    if (dot(apart, apart) >= far * far) continue;
    bool touching = false;
    Vector pushed{0.0, 0.0};  // i, by j
    for (const bool turned : {false, true}) {
      const int64_t i = turned ? pair.j : pair.i, j = turned ? pair.i : pair.j;
      const Vector from = turned ? apart * -1.0 : apart;
      const double reach = radii[j] + delta;
      for (int64_t v = first[i]; v < first[i + 1]; ++v) {
        const Vector point = from + spokes[v];
        Contact contact;
        if (dot(point, point) >= reach * reach || !find_contact(point, j, contact)) continue;
        contact.arm = spokes[v];
        if (with_stiffness && !touching)
          stiffness.push_back({pair.i, pair.j, apart, 0.0, {}, {}, {}});
        touching = true;
        add_contact(i, j, contact, with_stiffness ? &stiffness.back() : nullptr, turned);
        const double force = eps / delta * (1 - contact.distance / delta);
        pushed += contact.normal * (turned ? -force : force);
      }
    }
    if (!touching) continue;
    const double radial = dot(pushed, apart);
    virial += radial;
    if (with_stiffness) stiffness.back().radial = -radial;
    if (shears) {
      forces[3 * n] += (pushed.x * apart.x - pushed.y * apart.y) / box_coordinate();
      forces[3 * n + 1] += pushed.x * apart.y / box_coordinate();
    }
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

void RigidPolygons::move(const std::vector<double> &step, double factor)
{
  double stretch = 1.0, shear = 0.0;
  if (shears) {
    stretch = std::exp(factor * step[3 * n] / box_coordinate());
    shear = factor * step[3 * n + 1] / box_coordinate();
  }
  for (int64_t i = 0; i < n; ++i) {
    const auto [x, y] = centre(i);
    q[3 * i] = stretch * x + shear * y + factor * step[3 * i];
    q[3 * i + 1] = y / stretch + factor * step[3 * i + 1];
    q[3 * i + 2] += factor * step[3 * i + 2];
  }
  width *= stretch;
  tilt = stretch * tilt + shear * height;
  height /= stretch;
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
  before = *this;
  stiffness_before.swap(stiffness);
}

void RigidPolygons::go_back()
{
  static_cast<RigidState &>(*this) = before;
  stiffness.swap(stiffness_before);
}

std::vector<double> RigidPolygons::forces_of_scaling() const
{
  std::vector<double> u(forces.size(), 0.0);
  for (const Stiffness &pair : stiffness) {
    const Vector &d = pair.apart;
    double of_i[3];
    for (int a = 0; a < 3; ++a) {
      of_i[a] = pair.ii[3 * a] * d.x + pair.ii[3 * a + 1] * d.y;
      u[3 * pair.i + a] -= of_i[a];
      u[3 * pair.j + a] -= pair.ij[a] * d.x + pair.ij[3 + a] * d.y;
    }
    if (!shears) continue;
    u[3 * n] -= (of_i[0] * d.x - of_i[1] * d.y) / box_coordinate();
    u[3 * n + 1] -= of_i[0] * d.y / box_coordinate();
  }
  return u;
}

// Rows of this block belong to polygon i, or j, and columns to the two shears. A shear moves i
// against j by (s x + g y, -s y).
RigidPolygons::Block RigidPolygons::shear_block(const Stiffness &pair, bool of_j) const
{
  Block block{};
  const Vector &d = pair.apart;
  for (int a = 0; a < 3; ++a) {
    const double x = of_j ? pair.ij[a] : pair.ii[3 * a];
    const double y = of_j ? pair.ij[3 + a] : pair.ii[3 * a + 1];
    block[3 * a] = (x * d.x - y * d.y) / box_coordinate();
    block[3 * a + 1] = x * d.y / box_coordinate();
  }
  return block;
}

RigidPolygons::Block RigidPolygons::box_block(const Stiffness &pair) const
{
  const auto [x, y] = pair.apart;
  const double xx = pair.ii[0], xy = pair.ii[1], yy = pair.ii[4];
  const double square = box_coordinate() * box_coordinate();
  Block block{};
  block[0] = (x * x * xx - 2 * x * y * xy + y * y * yy + pair.radial) / square;
  block[1] = block[3] = (x * y * xx - y * y * xy) / square;
  block[4] = y * y * xx / square;
  return block;
}

// Calls act(i, j, block) for blocks whose sum is the matrix. Transposed blocks are left out.
template <class Act> void RigidPolygons::visit_blocks(Act act) const
{
  for (const Stiffness &pair : stiffness) {
    if (pair.i == pair.j) {
      Block both;
      for (int a = 0; a < 9; ++a)
        both[a] = pair.ii[a] + pair.jj[a] + pair.ij[a] + pair.ij[3 * (a % 3) + a / 3];
      act(pair.i, pair.i, both);
    } else {
      act(pair.i, pair.i, pair.ii);
      act(pair.j, pair.j, pair.jj);
      act(pair.i, pair.j, pair.ij);
    }
    if (!shears) continue;
    act(pair.i, n, shear_block(pair, false));
    act(pair.j, n, shear_block(pair, true));
    act(n, n, box_block(pair));
  }
}

// Returns whether the matrix is positive definite with this shift of the diagonal. `pin_loose`
// gives a stiffness of 1 to polygons without contacts, and to one polygon against translations of
// all.
bool RigidPolygons::factorise(double shift, bool pin_loose)
{
  std::vector<Factors::Entry> entries;
  const auto add = [&](int64_t i, int64_t j, const Block &block) {
    entries.push_back({static_cast<int>(i), static_cast<int>(j), block});
  };
  visit_blocks(add);
  if (shears) add(n, n, {0, 0, 0, 0, 0, 0, 0, 0, 1});
  if (pin_loose) {
    std::vector<int> contacts(n, 0);
    for (const Stiffness &pair : stiffness) {
      ++contacts[pair.i];
      ++contacts[pair.j];
    }
    for (int64_t i = 0; i < n; ++i)
      if (!contacts[i]) add(i, i, {1, 0, 0, 0, 1, 0, 0, 0, 1});
    const int64_t held = std::max_element(contacts.begin(), contacts.end()) - contacts.begin();
    if (contacts[held]) add(held, held, {1, 0, 0, 0, 1, 0, 0, 0, 0});
  }
  factors.set_pattern(static_cast<int>(n + shears), entries);
  factors.set(entries);
  return factors.factorise(shift);
}

void RigidPolygons::write_stiffness(double *matrix) const
{
  const std::size_t rows = forces.size();
  std::fill_n(matrix, rows * rows, 0.0);
  visit_blocks([&](int64_t i, int64_t j, const Block &block) {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        matrix[(3 * i + a) * rows + 3 * j + b] += block[3 * a + b];
        if (i != j) matrix[(3 * j + b) * rows + 3 * i + a] += block[3 * a + b];
      }
  });
}
