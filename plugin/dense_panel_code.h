// SPDX-License-Identifier: GPL-2.0-or-later
// Included by dense_panel.cpp once for each kind of processor: `Wide` are its vectors for factors,
// `Double` and `Single` those for solutions; its registers hold the sums of TILE columns and
// TILE_ROWS rows. Sums have one order in all of them.

static constexpr int LANES = sizeof(Wide) / sizeof(double);
static constexpr int PIECES = TILE_ROWS / LANES;    // vectors in a column of a tile

#define wide(from) (*reinterpret_cast<const Wide *>(from))
#define WIDE(to) (*reinterpret_cast<Wide *>(to))

/* Adds to a tile, columns of it `apart`, the sums over k < depth of a[r] b[q] (in column k), or
   starts with them. `signs`: of columns k. */
template <int COUNT, bool SIGNED>
static ALWAYS_INLINE void add_tile(const double *a, const double *b, int depth, Stride along,
                                   Stride beside, const double *signs, bool start, double *tile,
                                   Stride apart)
{
  Wide sums[COUNT][PIECES];
#pragma GCC unroll 8
  for (int q = 0; q < COUNT; q++)
#pragma GCC unroll 8
    for (int p = 0; p < PIECES; p++)
      if (start)
        sums[q][p] = Wide{};
      else
        sums[q][p] = wide(tile + q * apart + p * LANES);
  for (int k = 0; k < depth; k++, a += along, b += beside) {
    Wide rows[PIECES];
#pragma GCC unroll 8
    for (int p = 0; p < PIECES; p++) rows[p] = wide(a + p * LANES);
#pragma GCC unroll 8
    for (int q = 0; q < COUNT; q++)
#pragma GCC unroll 8
      for (int p = 0; p < PIECES; p++) sums[q][p] += rows[p] * (SIGNED ? signs[k] * b[q] : b[q]);
  }
#pragma GCC unroll 8
  for (int q = 0; q < COUNT; q++)
#pragma GCC unroll 8
    for (int p = 0; p < PIECES; p++) WIDE(tile + q * apart + p * LANES) = sums[q][p];
}

template <int COUNT, bool SIGNED>
static ALWAYS_INLINE void add_rows(const double *a, const double *b, int depth, Stride along,
                                   Stride beside, const double *signs, bool start, double *tile,
                                   Stride apart)
{
  for (int r = 0; r < PANEL_ROWS; r += TILE_ROWS)
    add_tile<COUNT, SIGNED>(a + r, b, depth, along, beside, signs, start, tile + r, apart);
}

/* The first columns of the lower triangle of rows S rows^T, S of signs. Large panels do not fit
   into the cache: copies of what is used again lie densely. */
template <bool SIGNED>
static void multiply_columns(const double *rows, int depth, int height, int columns, Stride stride,
                             const double *signs, double *product, Stride apart)
{
  alignas(64) double theirs[PANEL_COLUMNS * DEPTH], own[DEPTH * PANEL_ROWS];
  for (int begin = 0; begin < depth; begin += DEPTH) {
    const double *const from = rows + begin * stride;
    const int deep = std::min(DEPTH, depth - begin);
    for (int q = 0; q < columns; q += TILE)
      for (int k = 0; k < deep; k++)
        for (int c = 0; c < TILE; c++)
          theirs[q * DEPTH + TILE * k + c] =
              SIGNED ? signs[begin + k] * from[k * stride + q + c] : from[k * stride + q + c];
    for (int r = 0; r < height; r += PANEL_ROWS) {
      for (int k = 0; k < deep; k++)
        std::memcpy(own + PANEL_ROWS * k, from + k * stride + r, PANEL_ROWS * sizeof(double));
      for (int q = 0; q < std::min(columns, r + PANEL_ROWS); q += TILE)
        add_rows<TILE, false>(own, theirs + q * DEPTH, deep, PANEL_ROWS, TILE, nullptr, begin == 0,
                              product + q * apart + r, apart);
    }
  }
}

template <bool SIGNED>
static int factorise(double *panel, int width, int height, Stride stride, double *room,
                     double *signs, double least)
{
  alignas(64) double sums[COLUMNS * PANEL_ROWS];
  for (int first = 0; first < width; first += COLUMNS) {
    const int last = std::min(first + COLUMNS, width), wide = first - first % PANEL_COLUMNS;
    const double *const rest = panel + wide * stride;
    const Stride apart = padded(height - wide);
    if (wide && wide == first)
      multiply_columns<SIGNED>(panel + wide, wide, height - wide,
                               std::min(PANEL_COLUMNS, width - wide), stride, signs, room, apart);
    if (first)
      for (int r = first; r < height; r += PANEL_ROWS) {
        double *const known = room + (first - wide) * apart + r - wide;
        if (wide)
          for (int c = 0; c < COLUMNS; c++)
            std::memcpy(sums + PANEL_ROWS * c, known + c * apart, PANEL_ROWS * sizeof(double));
        add_rows<COLUMNS, SIGNED>(rest + r, rest + first, first - wide, stride, stride,
                                  signs + wide, wide == 0, sums, PANEL_ROWS);
        for (int c = first; c < last; c++)
          for (int k = 0; k < PANEL_ROWS; k++)
            panel[c * stride + r + k] -= sums[PANEL_ROWS * (c - first) + k];
      }
    for (int c = first; c < last; c++) {
      double *const __restrict own = panel + c * stride;
      for (int b = first; b < c; b++) {
        const double *const __restrict before = panel + b * stride;
        const double factor = SIGNED ? signs[b] * before[c] : before[c];
        for (int r = c; r < height; r++) own[r] -= factor * before[r];
      }
      if (SIGNED) signs[c] = own[c] < 0.0 ? -1.0 : 1.0;
      const double pivot = SIGNED ? signs[c] * own[c] : own[c];
      if (!(pivot > least)) return c;
      const double reciprocal = own[c] = 1.0 / std::sqrt(pivot);
      const double scale = SIGNED ? signs[c] * reciprocal : reciprocal;
      for (int r = c + 1; r < height; r++) own[r] *= scale;
      std::fill_n(own + height, PANEL_ROWS, 0.0);
    }
  }
  return width;
}

template <bool SIGNED>
static void multiply(const double *rows, int width, int height, Stride stride, const double *signs,
                     double *product, Stride apart)
{
  if (width > PANEL_COLUMNS && height > PANEL_COLUMNS) {
    for (int first = 0; first < height; first += PANEL_COLUMNS)
      multiply_columns<SIGNED>(rows + first, width, height - first,
                               std::min(PANEL_COLUMNS, height - first), stride, signs,
                               product + first * (apart + 1), apart);
    return;
  }
  for (int first = 0; first < height; first += COLUMNS)
    for (int r = first; r < height; r += PANEL_ROWS)
      add_rows<COLUMNS, SIGNED>(rows + r, rows + first, width, stride, stride, signs, true,
                                product + first * apart + r, apart);
}

#define four(numbers, row) (*reinterpret_cast<const Four *>((numbers) + TOGETHER * (row)))
#define FOUR(numbers, row) (*reinterpret_cast<Four *>((numbers) + TOGETHER * (row)))

/* Two columns at once, so that rows are read and written half as often. */
static void down_four(const double *panel, int width, int rows, Stride stride, double *own,
                      double *below)
{
  for (int c = 0; c < width; c += 2) {
    const double *const left = panel + c * stride;
    const Four x = FOUR(own, c) *= left[c];
    if (c + 1 == width) {
      for (int r = 0; r < rows; r++) FOUR(below, r) -= x * left[width + r];
      return;
    }
    const double *const right = left + stride;
    const Four y = FOUR(own, c + 1) = (four(own, c + 1) - x * left[c + 1]) * right[c + 1];
    for (int r = c + 2; r < width; r++) FOUR(own, r) = four(own, r) - x * left[r] - y * right[r];
    for (int r = 0; r < rows; r++)
      FOUR(below, r) = four(below, r) - x * left[width + r] - y * right[width + r];
  }
}

static void up_four(const double *panel, int width, int rows, Stride stride, double *own,
                    const double *below)
{
  int c = width - 1;
  for (; c > 0; c -= 2) {
    const double *const right = panel + c * stride, *const left = right - stride;
    Four x = {}, y = {};
    for (int r = 0; r < rows; r++) {
      x += four(below, r) * left[width + r];
      y += four(below, r) * right[width + r];
    }
    for (int r = c + 1; r < width; r++) {
      x += four(own, r) * left[r];
      y += four(own, r) * right[r];
    }
    y = FOUR(own, c) = (four(own, c) - y) * right[c];
    FOUR(own, c - 1) = (four(own, c - 1) - (x + y * left[c])) * left[c - 1];
  }
  if (c < 0) return;
  Four x = {};
  for (int r = 0; r < rows; r++) x += four(below, r) * panel[width + r];
  for (int r = 1; r < width; r++) x += four(own, r) * panel[r];
  FOUR(own, 0) = (four(own, 0) - x) * panel[0];
}

#define piece(from) (*reinterpret_cast<const Vector *>(from))
#define PIECE(to) (*reinterpret_cast<Vector *>(to))

/* COUNT columns at once. The rows that follow are taken in the order of the columns, so that the
   digits do not depend on COUNT. */
template <class Vector, int COUNT, class Number>
static ALWAYS_INLINE void take_down(const Number *column, int height, Stride stride,
                                    Number *numbers)
{
  Number x[COUNT];
  for (int a = 0; a < COUNT; a++) {
    x[a] = numbers[a];
    for (int b = 0; b < a; b++) x[a] -= column[b * stride + a] * x[b];
    numbers[a] = x[a] *= column[a * stride + a];
  }
  for (int r = COUNT; r < height; r += sizeof(Vector) / sizeof(Number)) {
    Vector left = piece(numbers + r);
#pragma GCC unroll 4
    for (int b = 0; b < COUNT; b++) left -= piece(column + b * stride + r) * x[b];
    PIECE(numbers + r) = left;
  }
}

/* The sum of each column is that of 4 or 8 sums, which take turns, whatever the vectors hold. */
template <class Vector, int COUNT, class Number>
static ALWAYS_INLINE void take_up(const Number *column, int height, Stride stride, Number *numbers)
{
  constexpr int LENGTH = sizeof(Vector) / sizeof(Number);
  constexpr int TURNS = 32 / sizeof(Number), PARTS = TURNS / LENGTH;
  Vector sums[COUNT][PARTS] = {};
  for (int r = COUNT; r < height; r += TURNS)
#pragma GCC unroll 4
    for (int b = 0; b < COUNT; b++)
#pragma GCC unroll 2
      for (int p = 0; p < PARTS; p++)
        sums[b][p] +=
            piece(column + b * stride + r + p * LENGTH) * piece(numbers + r + p * LENGTH);
#pragma GCC unroll 4
  for (int b = COUNT - 1; b >= 0; b--) {
    Number parts[TURNS];
    for (int p = 0; p < PARTS; p++) PIECE(parts + p * LENGTH) = sums[b][p];
#pragma GCC unroll 3
    for (int half = TURNS / 2; half > 0; half /= 2)
#pragma GCC unroll 4
      for (int k = 0; k < half; k++) parts[k] += parts[k + half];
    Number left = numbers[b] - parts[0];
#pragma GCC unroll 4
    for (int a = COUNT - 1; a > b; a--) left -= column[b * stride + a] * numbers[a];
    numbers[b] = left * column[b * stride + b];
  }
}

template <class Vector, class Number>
static void down(const Number *panel, int width, int height, Stride stride, Number *numbers)
{
  int c = 0;
  for (; c + 4 <= width; c += 4)
    take_down<Vector, 4>(panel + c * (stride + 1), height - c, stride, numbers + c);
  panel += c * (stride + 1);
  if (width - c == 3) take_down<Vector, 3>(panel, height - c, stride, numbers + c);
  if (width - c == 2) take_down<Vector, 2>(panel, height - c, stride, numbers + c);
  if (width - c == 1) take_down<Vector, 1>(panel, height - c, stride, numbers + c);
}

template <class Vector, class Number>
static void up(const Number *panel, int width, int height, Stride stride, Number *numbers)
{
  int c = width - width % 4;
  const Number *const last = panel + c * (stride + 1);
  if (width - c == 3) take_up<Vector, 3>(last, height - c, stride, numbers + c);
  if (width - c == 2) take_up<Vector, 2>(last, height - c, stride, numbers + c);
  if (width - c == 1) take_up<Vector, 1>(last, height - c, stride, numbers + c);
  while ((c -= 4) >= 0)
    take_up<Vector, 4>(panel + c * (stride + 1), height - c, stride, numbers + c);
}

#undef piece
#undef PIECE

/* COUNT columns at once, of panels that have some such columns. Each sum takes row after row, first
   those below the triangle. */
template <int COUNT>
static void up_in_order(const double *panel, int width, int height, Stride stride, double *numbers)
{
  for (int c = width - COUNT; c >= 0; c -= COUNT) {
    const double *const column = panel + c * stride;
    double sums[COUNT] = {};
#pragma omp simd reduction(+ : sums[:COUNT])
    for (int r = width; r < height; r++)
      for (int b = 0; b < COUNT; b++) sums[b] += column[b * stride + r] * numbers[r];
    for (int r = c + COUNT; r < width; r++)
      for (int b = 0; b < COUNT; b++) sums[b] += column[b * stride + r] * numbers[r];
    for (int b = COUNT - 1; b >= 0; b--) {
      for (int a = b + 1; a < COUNT; a++) sums[b] += column[b * stride + c + a] * numbers[c + a];
      numbers[c + b] = (numbers[c + b] - sums[b]) * column[b * stride + c + b];
    }
  }
}
#undef four
#undef FOUR
#undef wide
#undef WIDE

static constexpr DensePanels FUNCTIONS = {
    factorise<false>, factorise<true>, multiply<false>, multiply<true>, down<Double>, up<Double>,
    up_in_order<3>, down<Single>, up<Single>, down_four, up_four};
