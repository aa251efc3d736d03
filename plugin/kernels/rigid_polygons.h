// This file finds the energy of rigid regular polygons with rims, and its first two derivatives.
//
// A vertex of one polygon and the nearest point of the outline of another, at a distance d below
// delta, have the energy (eps/2) (1 - d/delta)^2, the form "outline". A polygon has three
// coordinates: its centre and R times its angle, with R the radius through its vertices. Two shears
// of the box at constant area,
//
//     F(s, g) = [[exp(s), g], [0, exp(-s)]],   centre -> F centre + u,
//
// may be coordinates as well. They follow the polygons' coordinates, as sqrt(n) s and sqrt(n) g.
#pragma once

#include "../block_cholesky.h"
#include "periodic_grid.h"

#include <vector>

namespace jamlab {

// A vertex and the nearest point of the outline of another polygon. The vertex belongs to the first
// polygon of the pair, or to the second where it is `turned`.
struct RimContact {
  double overlap;      // delta - d, below 0 for a gap
  double slope[6];     // of d, in the coordinates of the vertex's polygon and of the other
  double distance;     // d
  Vector normal;       // unit vector
  Vector arm;          // the vertex, from its own centre
  Vector point, foot;  // the vertex and its foot, from the other centre
  bool turned, corner;  // corner: the foot is a vertex
};

// Two polygons with contacts or gaps from `first` to `last`.
struct NearPair {
  int64_t i, j;
  Vector apart;  // centre of i less the centre of the image of j
  int64_t first, last;
};

// A step of a minimisation changes this part of the polygons.
struct RigidState {
  std::vector<double> q;       // x, y and R times the angle of each polygon
  double width, tilt, height;  // rows of the box: (width, 0), (tilt, height)
  double energy = 0.0;
  double virial = 0.0;         // sum of force times distance of centres
  double contact_force = 0.0;  // the largest of a contact
  bool crossed = false;        // a vertex lies inside another polygon, and no contact pushes it out
  std::vector<double> forces;  // -dE/dq, three numbers of each polygon, and of a box that shears
  std::vector<RimContact> contacts;  // and gaps
  std::vector<NearPair> near;
  Vector centre(int64_t i) const { return {q[3 * i], q[3 * i + 1]}; }
};

class RigidPolygons : public RigidState {
 public:
  using Numbers = std::vector<double>;

  // counts (n): vertices of each polygon; radii (n); box (2, 2); coordinates (n, 3)
  RigidPolygons(int64_t n, const int64_t *counts, const double *radii, double eps, double delta,
                const double *box, const double *coordinates, bool shears);

  void evaluate(double margin);  // margin: widest gap that is listed
  double largest_force() const;  // of a polygon, its torque over its radius, or of the box
  void scale(double factor);  // box and centres
  void keep();                // the state before a move
  void move(const Numbers &step, double factor);  // from the kept state
  void go_back();             // to the kept state
  const RigidState &kept() const { return before; }

  double spring() const { return eps / (delta * delta); }  // of a contact
  void assemble();  // second derivatives of the energy, as if gaps were contacts
  bool factorise(double shift, bool pin_loose = false);
  void solve(Numbers &r, bool roughly = false)
  {
    roughly ? factors.solve_roughly(r) : factors.solve(r);
  }
  Numbers forces_of_scaling() const;           // forces that an isotropic strain brings, over it
  void write_stiffness(double *matrix) const;  // of all coordinates, dense

 private:
  using Factors = LAMMPS_NS::BlockCholesky<3>;
  using Block = Factors::Block;
  struct Pair {
    int64_t i, j;
    Image shift;  // of j
    int64_t vertex[2] = {0, 0}, edge[2] = {0, 0};  // nearest ones last seen, of i and j, j and i
  };
  struct Stiffness {  // second derivatives of the energy of one pair
    int64_t i, j;
    Vector apart;
    double radial;  // first derivative of the energy along `apart`, times its length
    Block ii, ij, jj;
  };

  int64_t n;
  bool shears;
  double eps, delta;
  std::vector<int64_t> first;           // vertex of each polygon
  std::vector<double> radii;
  std::vector<Vector> resting, spokes;  // vertices around their centres, at angle 0 and now
  std::vector<Pair> pairs;
  RigidState listed;                    // the state for which pairs were listed
  RigidState before;
  std::vector<Stiffness> stiffness;  // of near pairs
  std::vector<Factors::Entry> entries;
  Factors factors;

  double box_coordinate() const { return std::sqrt(static_cast<double>(n)); }  // of a strain of 1
  bool list_holds() const;
  void list_pairs();
  void turn_spokes();
  int64_t nearest_vertex(int64_t i, const Vector &from, int64_t v) const;
  int64_t edge_below(const Vector &point, int64_t j, int64_t edge) const;
  void find_contacts(Pair &pair, const Vector &apart, bool turned, double reach);
  bool find_contact(int64_t i, int64_t j, int64_t edge, double reach, RimContact &contact);
  void push(const NearPair &pair);
  void add_stiffness(const RimContact &contact, Stiffness &to) const;
  Block shear_block(const Stiffness &pair, bool of_j) const;
  Block box_block(const Stiffness &pair) const;
  template <class Act> void visit_blocks(Act act) const;
};

}  // namespace jamlab
