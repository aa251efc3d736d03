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
   0. */
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

  // Finds the candidates after each neighbor build.
  void build(const FixPolygonOutline *, const class NeighList *, const ContactLaws &, ContactForm);

  // A block of rows stays in the cache until the forces of its contacts are known.
  struct Block {
    int begin, end;              // rows
    int edge_begin, edge_end;    // edges near them, which near() counts from edge_begin
  };
  const std::vector<Block> &blocks() const { return block_list; }

  // Finds the frames of the edges of a block at present positions; its contacts need them.
  void measure_edges(const Block &);

  const CandidateRow *rows() const { return row_list.data(); }
  const int *near() const { return near_list.data(); }    // numbers of edges
  std::size_t most_contacts(const Block &block) const
  {
    return row_list[block.end - 1].end - row_list[block.begin].begin;
  }
  const Edge *edges(const Block &block) const { return &edge_list[block.edge_begin]; }
  const EdgeFrame *frames() const { return frame_list.data(); }    // of the last measured block
  double memory_usage() const
  {
    return bytes(row_list, near_list, edge_list, frame_list, edge_from, all_frames, of_point);
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

  const FixPolygonOutline *outline = nullptr;
  const ContactLaws *laws = nullptr;
  std::vector<CandidateRow> row_list;
  std::vector<int> near_list;
  std::vector<Block> block_list;
  std::vector<Edge> edge_list;
  std::vector<EdgeFrame> frame_list;
  std::vector<int> edge_from;           // of each atom the number of its edge in this block, or -1
  std::vector<EdgeFrame> all_frames;    // at the build, of the edge that starts at each atom
  std::vector<Candidate> of_point;      // of one point

  Block last_block() const { return block_list.empty() ? Block{} : block_list.back(); }
  void find_edges();
  void find_near_point(int, const class NeighList *, ContactForm);
  void end_block();
  void keep(int);
  bool earlier(int, int) const;
  bool one_outline(int, int) const;
};

}    // namespace LAMMPS_NS
