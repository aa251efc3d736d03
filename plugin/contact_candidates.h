// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "contact_law.h"
#include "edge_geometry.h"
#include "fix_polygon_outline.h"
#include "pointers.h"
#include "vector_bytes.h"

#include <tuple>
#include <vector>

namespace LAMMPS_NS {

/* ContactCandidates are the edges that each vertex or disk can touch until the next neighbor build.
   A wall is an outline like a polygon's. A disk is a point; to another disk it is an edge of length
   0.

   Few of them come near: the close candidates are those that can touch until an atom has moved by
   half a margin, which is a part of the skin. They are found anew when one has, and give the same
   contacts in the same order. */
class ContactCandidates : protected Pointers {
 public:
  ContactCandidates(class LAMMPS *lmp) : Pointers(lmp) {}

  struct Edge {
    int tail, head;
  };
  struct CandidateRow {    // edges of one law near a point
    int i;                 // the point
    int law;               // number in PairLaws
    int begin, end;        // range in near()
  };
  struct Near {
    int point, edge;    // number of the edge in its block
  };

  // Finds the candidates after each neighbor build.
  void build(const FixPolygonOutline *, const class NeighList *, const ContactLaws &, ContactForm);

  // Turns to the candidates for contacts with gaps up to `beyond` at present positions; the
  // functions below are about these.
  void choose(double beyond);

  // A block of rows stays in the cache until the forces of its contacts are known.
  struct Block {
    int begin, end;              // rows
    int edge_begin, edge_end;    // edges near them, which near() counts from edge_begin
  };
  const std::vector<Block> &blocks() const { return chosen().blocks; }

  // Finds the frames of the edges of a block at present positions, and the squares of the distances
  // of its candidates.
  void measure(const Block &);

  const CandidateRow *rows() const { return chosen().rows.data(); }
  const Near *near() const { return chosen().near.data(); }
  std::size_t most_contacts(const Block &block) const
  {
    return rows()[block.end - 1].end - rows()[block.begin].begin;
  }
  const Edge *edges(const Block &block) const { return &chosen().edges[block.edge_begin]; }
  // of the last measured block
  const EdgeFrame *frames() const { return frame_list.data(); }
  const double *squares() const { return square_list.data() - first_square; }
  double memory_usage() const
  {
    return all.memory_usage() + close.memory_usage() +
        bytes(frame_list, square_list, edge_from, all_frames, of_point, movers, places);
  }

 private:
  struct Candidate {
    tagint molecule, tag;
    ImageOffset image;
    Edge edge;
    int law;
    bool same_outline(const Candidate &o) const
    {
      return molecule == o.molecule && image == o.image && edge.tail != edge.head &&
          o.edge.tail != o.edge.head;
    }
    bool operator<(const Candidate &o) const
    {
      return std::tie(molecule, image, tag) < std::tie(o.molecule, o.image, o.tag);
    }
  };

  struct List {
    std::vector<CandidateRow> rows;
    std::vector<Near> near;
    std::vector<Block> blocks;
    std::vector<Edge> edges;

    Block last_block() const { return blocks.empty() ? Block{} : blocks.back(); }
    void clear();
    double memory_usage() const { return bytes(rows, near, blocks, edges); }
  };

  const FixPolygonOutline *outline = nullptr;
  const ContactLaws *laws = nullptr;
  List all, close;
  std::vector<EdgeFrame> frame_list;
  std::vector<double> square_list;
  int first_square = 0;                 // place of its first number in near()
  std::vector<int> edge_from;           // of each atom the number of its edge in this block, or -1
  std::vector<EdgeFrame> all_frames;    // at the build, of the edge that starts at each atom
  std::vector<Candidate> of_point;      // of one point

  struct Place {
    double x, y;
  };
  static constexpr double MOST = 0.25;    // of the skin
  std::vector<int> movers;                // atoms and ghosts of all candidates
  std::vector<Place> places;              // of them, when the close candidates were found
  double part = MOST;                     // of the skin: the margin of close candidates
  bigint evaluations = 0;                 // with the present ones, or since they did not pay
  bool use_close = false;

  const List &chosen() const { return use_close ? close : all; }
  void find_edges();
  void find_near_point(int, const class NeighList *, ContactForm);
  void keep(int);
  void begin_row(List &, int i, int law);
  void add_to_row(List &, const Edge &);
  void end_block(List &, std::size_t least);
  void adapt_margin();
  void find_movers();
  bool moved() const;
  void find_close();
  bool earlier(int, int) const;
  bool one_outline(int, int) const;
};

}    // namespace LAMMPS_NS
