#include "rigid_polygons.h"

#include "kernel.h"

#include <algorithm>
#include <cmath>

using namespace jamlab;

// of kernels/periodic_neighbors.cpp
JAMLAB_KERNEL periodic_neighbors(int64_t n_a, const double *a, const double *reach_a, int64_t n_b, const double *b,
                                 const double *reach_b, const double *box, int64_t once, double most_copies,
                                 int64_t room, int64_t *i, int64_t *j, double *r, int64_t *shift, double *search);

namespace {

constexpr double TWO_PI = 6.283185307179586477;
constexpr double SKIN = 0.3;            // extra reach of the list of pairs, mean diameter
constexpr double TOUCHING = 1e-12;      // distance over delta below which a contact has no direction
constexpr double MOST_COPIES = 1e8;

// H = k g g' - f grad grad d for the coordinates of a vertex's polygon and of the other, `scaled` their radii.
struct Gradient {
  double of[6];
};

void add_outer(double (&h)[6][6], double factor, const Gradient &g)
{
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) h[a][b] += factor * g.of[a] * g.of[b];
}

Gradient gradient_along(const Vector &direction, const Vector &arm, const Vector &foot, double radius_i,
                        double radius_j)
{
  return {{direction.x, direction.y, cross(arm, direction) / radius_i, -direction.x, -direction.y,
           -cross(foot, direction) / radius_j}};
}

}  // namespace

RigidPolygons::RigidPolygons(int64_t n, const int64_t *counts, const double *radii_, double eps, double delta,
                             const double *box, const double *coordinates, bool shears) :
    n(n), shears(shears), eps(eps), delta(delta), first(n + 1, 0), radii(radii_, radii_ + n)
{
  q.assign(coordinates, coordinates + 3 * n);
  width = box[0];
  tilt = box[2];
  height = box[3];
  for (int64_t i = 0; i < n; ++i) {
    first[i + 1] = first[i] + counts[i];
    for (int64_t k = 0; k < counts[i]; ++k)
      resting.push_back(Vector{std::cos(TWO_PI * k / counts[i]), std::sin(TWO_PI * k / counts[i])} * radii[i]);
  }
  spokes.resize(resting.size());
  forces.resize(3 * (n + shears));
}

double RigidPolygons::box_coordinate() const
{
  return std::sqrt(static_cast<double>(n));
}

// ----------------------------------------------------------------------- pairs that may touch

bool RigidPolygons::list_holds() const
{
  if (listed.q.empty()) return false;
  const double xx = width / listed.width, yy = height / listed.height, xy = (tilt - yy * listed.tilt) / listed.height;
  double square = 0.0;
  for (int64_t i = 0; i < n; ++i) {
    const double x = listed.q[3 * i], y = listed.q[3 * i + 1];
    const Vector moved{q[3 * i] - xx * x - xy * y, q[3 * i + 1] - yy * y};
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
    centres[2 * i] = q[3 * i];
    centres[2 * i + 1] = q[3 * i + 1];
    reach[i] = radii[i] + 0.5 * (delta + SKIN);
  }
  const double box[4] = {width, 0.0, tilt, height};
  double search[5];
  std::vector<int64_t> i, j, shift;
  std::vector<double> r;
  for (int64_t room = 8 * n + 16, found = room + 1; found > room;) {
    i.resize(room);
    j.resize(room);
    shift.resize(2 * room);
    r.resize(2 * room);
    found = periodic_neighbors(n, centres.data(), reach.data(), n, centres.data(), reach.data(), box, 1, MOST_COPIES,
                               room, i.data(), j.data(), r.data(), shift.data(), search);
    if (found > room) {
      room = found;
      found = room + 1;
      continue;
    }
    pairs.clear();
    for (int64_t k = 0; k < found; ++k) pairs.push_back({i[k], j[k], {shift[2 * k], shift[2 * k + 1]}});
    crossed = found < 0;  // centres so far away that no search finds them
  }
  listed.q = q;
  listed.width = width;
  listed.tilt = tilt;
  listed.height = height;
}

// ----------------------------------------------------------------------- energy and its derivatives

void RigidPolygons::turn_spokes()
{
  for (int64_t i = 0; i < n; ++i) {
    const double angle = q[3 * i + 2] / radii[i], c = std::cos(angle), s = std::sin(angle);
    for (int64_t v = first[i]; v < first[i + 1]; ++v)
      spokes[v] = {c * resting[v].x - s * resting[v].y, s * resting[v].x + c * resting[v].y};
  }
}

// The contact of a point, seen from the centre of polygon j, with its outline: the nearest edge is that of its sector.
bool RigidPolygons::meet(const Vector &point, int64_t j, Contact &contact)
{
  const int64_t count = first[j + 1] - first[j];
  double sector = (std::atan2(point.y, point.x) - q[3 * j + 2] / radii[j]) * count / TWO_PI;
  sector -= count * std::floor(sector / count);
  const int64_t edge = std::min(static_cast<int64_t>(sector), count - 1);
  const Vector tail = spokes[first[j] + edge], head = spokes[first[j] + (edge + 1 == count ? 0 : edge + 1)];
  const Vector along = head - tail;
  const double part = dot(point - tail, along) / dot(along, along);
  contact.corner = part <= 0 || part >= 1;
  contact.foot = tail + along * std::min(1.0, std::max(0.0, part));
  contact.point = point;
  const Vector gap = point - contact.foot;
  contact.distance = size(gap);
  if (cross(along, point - tail) > 0) crossed = true;
  if (contact.distance >= delta || contact.distance < TOUCHING * delta) return false;
  contact.normal = gap * (1 / contact.distance);
  return true;
}

void RigidPolygons::press(int64_t i, int64_t j, const Contact &c, Stiffness *second, bool turned)
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
    const double mixed[6] = {across.x * per_j, across.y * per_j, turn * per_i * per_j, -across.x * per_j,
                             -across.y * per_j, 0.0};
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
    const Vector moved{pair.shift.first * width + pair.shift.second * tilt, pair.shift.second * height};
    const Vector apart = Vector{q[3 * pair.i], q[3 * pair.i + 1]} - Vector{q[3 * pair.j], q[3 * pair.j + 1]} - moved;
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
        if (dot(point, point) >= reach * reach || !meet(point, j, contact)) continue;
        contact.arm = spokes[v];
        if (with_stiffness && !touching) stiffness.push_back({pair.i, pair.j, apart, 0.0, {}, {}, {}});
        touching = true;
        press(i, j, contact, with_stiffness ? &stiffness.back() : nullptr, turned);
        pushed = pushed + contact.normal * ((turned ? -1.0 : 1.0) * eps / delta * (1 - contact.distance / delta));
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
  for (std::size_t i = 0; i < forces.size(); i += 3)
    square = std::max({square, forces[i] * forces[i] + forces[i + 1] * forces[i + 1], forces[i + 2] * forces[i + 2]});
  return std::sqrt(square);
}

// ----------------------------------------------------------------------- moves

void RigidPolygons::move(const std::vector<double> &step, double factor)
{
  double stretch = 1.0, shear = 0.0;
  if (shears) {
    stretch = std::exp(factor * step[3 * n] / box_coordinate());
    shear = factor * step[3 * n + 1] / box_coordinate();
  }
  for (int64_t i = 0; i < n; ++i) {
    const double x = q[3 * i], y = q[3 * i + 1];
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
    for (int a = 0; a < 3; ++a) {
      u[3 * pair.i + a] -= pair.ii[3 * a] * d.x + pair.ii[3 * a + 1] * d.y;
      u[3 * pair.j + a] -= pair.ij[a] * d.x + pair.ij[3 + a] * d.y;
    }
    if (shears) {
      const Vector f{pair.ii[0] * d.x + pair.ii[1] * d.y, pair.ii[3] * d.x + pair.ii[4] * d.y};
      u[3 * n] -= (f.x * d.x - f.y * d.y) / box_coordinate();
      u[3 * n + 1] -= f.x * d.y / box_coordinate();
    }
  }
  return u;
}

// ----------------------------------------------------------------------- the matrix of second derivatives

// Rows of polygon i, or j, columns of the two shears: a shear moves i against j by (s x + g y, -s y).
std::array<double, 9> RigidPolygons::shear_block(const Stiffness &pair, bool of_j) const
{
  std::array<double, 9> block{};
  const Vector &d = pair.apart;
  for (int a = 0; a < 3; ++a) {
    const double x = of_j ? pair.ij[a] : pair.ii[3 * a], y = of_j ? pair.ij[3 + a] : pair.ii[3 * a + 1];
    block[3 * a] = (x * d.x - y * d.y) / box_coordinate();
    block[3 * a + 1] = x * d.y / box_coordinate();
  }
  return block;
}

std::array<double, 9> RigidPolygons::box_block(const Stiffness &pair) const
{
  const Vector &d = pair.apart;
  const double xx = pair.ii[0], xy = pair.ii[1], yy = pair.ii[4], square = box_coordinate() * box_coordinate();
  std::array<double, 9> block{};
  block[0] = (d.x * d.x * xx - 2 * d.x * d.y * xy + d.y * d.y * yy + pair.radial) / square;
  block[1] = block[3] = (d.x * d.y * xx - d.y * d.y * xy) / square;
  block[4] = d.y * d.y * xx / square;
  return block;
}

// Positive definite with this shift of the diagonal? `pin_loose`: polygons without contacts, and one of the others
// against translations of all, have a stiffness of 1.
bool RigidPolygons::factorise(double shift, bool pin_loose)
{
  std::vector<LAMMPS_NS::BlockCholesky<3>::Entry> entries;
  const int box = static_cast<int>(n);
  for (const Stiffness &pair : stiffness) {
    const int i = static_cast<int>(pair.i), j = static_cast<int>(pair.j);
    if (i == j) {
      std::array<double, 9> both;
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
          both[3 * a + b] = pair.ii[3 * a + b] + pair.jj[3 * a + b] + pair.ij[3 * a + b] + pair.ij[3 * b + a];
      entries.push_back({i, i, both});
    } else {
      entries.push_back({i, i, pair.ii});
      entries.push_back({j, j, pair.jj});
      entries.push_back({i, j, pair.ij});
    }
    if (shears) {
      entries.push_back({i, box, shear_block(pair, false)});
      entries.push_back({j, box, shear_block(pair, true)});
      entries.push_back({box, box, box_block(pair)});
    }
  }
  if (shears) entries.push_back({box, box, {0, 0, 0, 0, 0, 0, 0, 0, 1}});
  if (pin_loose) {
    std::vector<int> contacts(n, 0);
    for (const Stiffness &pair : stiffness) {
      ++contacts[pair.i];
      ++contacts[pair.j];
    }
    for (int64_t i = 0; i < n; ++i)
      if (!contacts[i]) entries.push_back({static_cast<int>(i), static_cast<int>(i), {1, 0, 0, 0, 1, 0, 0, 0, 1}});
    const int held = static_cast<int>(std::max_element(contacts.begin(), contacts.end()) - contacts.begin());
    if (contacts[held]) entries.push_back({held, held, {1, 0, 0, 0, 1, 0, 0, 0, 0}});
  }
  factors.set_pattern(static_cast<int>(n + shears), entries);
  factors.set(entries);
  return factors.factorise(shift);
}

void RigidPolygons::write_stiffness(double *matrix) const
{
  const std::size_t rows = forces.size();
  std::fill_n(matrix, rows * rows, 0.0);
  const auto add = [&](int64_t i, int64_t j, const std::array<double, 9> &block, bool both) {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        matrix[(3 * i + a) * rows + 3 * j + b] += block[3 * a + b];
        if (both) matrix[(3 * j + b) * rows + 3 * i + a] += block[3 * a + b];
      }
  };
  for (const Stiffness &pair : stiffness) {
    add(pair.i, pair.i, pair.ii, false);
    add(pair.j, pair.j, pair.jj, false);
    add(pair.i, pair.j, pair.ij, true);
    if (!shears) continue;
    add(pair.i, n, shear_block(pair, false), true);
    add(pair.j, n, shear_block(pair, true), true);
    add(n, n, box_block(pair), false);
  }
}
