// This file measures what droplets cover, and lists the pieces of its boundary.

#include "droplet_outlines.h"
#include "kernel.h"

using namespace jamlab;

namespace {

// By Green's theorem the area of a region is a sum over the pieces of its boundary. Where m grown
// polygons overlap, each of them counts 1/m of the overlap. A part of an outline with k others
// above it has 1/(k + 1) on its own side and 1/k on the other side, which is none of its own.
class Cover {
 public:
  Cover(const DropletOutlines &of, double *share, double *area, double *perimeter)
    : outlines(of), share(share), area(area), perimeter(perimeter), gap(of.n, Vector{0, 0})
  {
    std::fill(share, share + of.n, 0.0);
    std::fill(area, area + of.n, 0.0);
    std::fill(perimeter, perimeter + of.n, 0.0);
  }

  void add(const OutlinePart &part)
  {
    const RimEdge &edge = outlines.edges[part.edge];
    const int64_t own = edge.particle;
    const Vector home = outlines.home(own), chord = part.to - part.from;
    const double turned = part.end - part.begin, w = outlines.w;
    double green = 0.5 * cross(part.from - home, chord);
    if (part.arc) green += 0.5 * w * w * (turned - std::sin(turned));
    area[own] += green;
    perimeter[own] += part.arc ? w * turned : turned;
    const double others = static_cast<double>(part.covers.size()), inner = 1 / (others + 1);
    give(own, inner, green, chord);
    for (const NearPolygon &by : part.covers) {
      const Vector apart = outlines.home(by.particle) + outlines.translation(by.shift) - home;
      give(by.particle, inner - 1 / others, green - 0.5 * cross(apart, chord), chord);
    }
  }

  // Returns how far the boundary of what the polygons have is from closed.
  double largest_gap() const
  {
    double largest = 0.0;
    for (const Vector &one : gap) largest = std::max(largest, std::hypot(one.x, one.y));
    return largest;
  }

 private:
  const DropletOutlines &outlines;
  double *share, *area, *perimeter;
  std::vector<Vector> gap;

  void give(int64_t particle, double weight, double green, const Vector &chord)
  {
    share[particle] += weight * green;
    gap[particle] += chord * weight;
  }
};

// Pieces of the boundary, first the straight ones, and which comes next on the same polygon.
class FreePieces {
 public:
  explicit FreePieces(const DropletOutlines &of)
    : outlines(of), line_at(of.edges.size(), -1), arc_at(of.edges.size(), -1)
  {}

  void add(const OutlinePart &part)
  {
    std::vector<Piece> &list = part.arc ? arcs : lines;
    const int64_t number = static_cast<int64_t>(list.size());
    if (part.begin == 0) (part.arc ? arc_at : line_at)[part.edge] = number;
    list.push_back({part.edge, part.begin, part.end, part.from, part.to});
  }

  int64_t count() const { return static_cast<int64_t>(lines.size() + arcs.size()); }

  void write(int64_t *particle, double *start, double *end, double *centre, double *radius,
             double *begin, double *angle, int64_t *following) const
  {
    int64_t k = 0;
    for (const std::vector<Piece> *list : {&lines, &arcs})
      for (const Piece &piece : *list) {
        const RimEdge &edge = outlines.edges[piece.edge];
        const bool arc = list == &arcs;
        particle[k] = edge.particle;
        put(start, k, piece.from);
        put(end, k, piece.to);
        put(centre, k, arc ? edge.tail : (piece.from + piece.to) * 0.5);
        radius[k] = arc ? outlines.w : 0.0;
        begin[k] = arc ? outlines.start_of_arc(piece.edge) + piece.begin : 0.0;
        angle[k] = arc ? piece.end - piece.begin : 0.0;
        following[k++] = arc ? behind_arc(piece) : behind_line(piece);
      }
  }

 private:
  struct Piece {
    int64_t edge;
    double begin, end;
    Vector from, to;
  };
  const DropletOutlines &outlines;
  std::vector<int64_t> line_at, arc_at;  // pieces that begin where their element does, or -1
  std::vector<Piece> lines, arcs;

  int64_t behind_arc(const Piece &piece) const
  {
    return piece.end == outlines.edges[piece.edge].turn ? line_at[piece.edge] : -1;
  }

  int64_t behind_line(const Piece &piece) const
  {
    const RimEdge &edge = outlines.edges[piece.edge];
    if (piece.end != edge.length) return -1;
    if (!(outlines.edges[edge.after].turn > 0)) return line_at[edge.after];
    const int64_t arc = arc_at[edge.after];
    return arc < 0 ? -1 : arc + static_cast<int64_t>(lines.size());
  }
};

}  // namespace

// What droplets cover, and its boundary.
//   offsets (n + 1), x (vertices, 2), box (2, 2), w: width of rims;
//   share, area, perimeter (n) out: area with overlaps shared, area and perimeter with rims;
//   meeting (3) out: how outlines without rims meet, see Meeting, and of which two polygons;
//   gap (1) out: by which the boundary of a share fails to close;
//   particle, radius, begin, angle, following (room), start, end, centre (room, 2) out: pieces of
//   the boundary, see Pieces, and which comes next on the same polygon, else -1;
//   search (5) out: see visit_neighbors.
// Returns the number of pieces, which are written if there is room, or why there is none.
JAMLAB_KERNEL droplet_cover(int64_t n, const int64_t *offsets, const double *x, const double *box,
                            double w, double most_copies, int64_t room, double *share, double *area,
                            double *perimeter, int64_t *meeting, double *gap, int64_t *particle,
                            double *start, double *end, double *centre, double *radius,
                            double *begin, double *angle, int64_t *following, double *search)
try {
  DropletOutlines outlines(n, offsets, x, box, w);
  const int64_t refusal = outlines.find_near(most_copies, search);
  if (refusal < 0) return refusal;
  meeting[0] = outlines.meeting;
  std::copy(outlines.met, outlines.met + 2, meeting + 1);
  Cover cover(outlines, share, area, perimeter);
  FreePieces pieces(outlines);
  OutlineCutter cutter(outlines);
  const auto act = [&](const OutlinePart &part) {
    cover.add(part);
    if (part.covers.empty()) pieces.add(part);
  };
  for (int64_t edge = 0; edge < static_cast<int64_t>(outlines.edges.size()); ++edge) {
    cutter.cut_corner(edge, act);
    cutter.cut_edge(edge, act);
  }
  *gap = cover.largest_gap();
  if (pieces.count() <= room)
    pieces.write(particle, start, end, centre, radius, begin, angle, following);
  return pieces.count();
}
JAMLAB_OR_NO_MEMORY
