#include "core/report/contact_sheet.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/image/draw.h"

namespace color3d {
namespace {

constexpr int kWidthPx = 1600;
constexpr int kMarginPx = 24;
constexpr int kGapPx = 12;
constexpr int kFramePx = 6;
constexpr int kTitlePx = 20;
constexpr int kTextPx = 12;
constexpr int kLinePx = 20;
constexpr int kMinColumns = 3;
constexpr int kMaxColumns = 8;
constexpr int kAsideColumns = 8;
constexpr float kAsideStrength = 0.45f;

constexpr DrawColor kPaper{0.97f, 0.97f, 0.96f};
constexpr DrawColor kInk{0.13f, 0.13f, 0.14f};
constexpr DrawColor kFaint{0.45f, 0.45f, 0.47f};
constexpr DrawColor kChosen{0.93f, 0.55f, 0.05f};

// Rows of equal cells, each with a picture and two lines of text.
struct Grid {
  int columns = 1;
  int count = 0;
  int cell_px = 0;     // width
  int picture_px = 0;  // height of the picture area

  int RowHeight() const { return picture_px + 2 * kLinePx + 2 * kGapPx; }
  int Height() const { return (count + columns - 1) / columns * RowHeight(); }
  int X(int i) const { return kMarginPx + i % columns * (cell_px + kGapPx); }
  int Y(int i) const { return i / columns * RowHeight(); }
};

Grid LayOutGrid(const std::vector<SheetView>& views, int columns) {
  // Wide pictures need less height than their width.
  double tallest = 0.5;
  for (const SheetView& view : views) {
    if (view.thumbnail.Empty()) continue;
    const double aspect = static_cast<double>(view.thumbnail.height) / view.thumbnail.width;
    tallest = std::max(tallest, std::min(1.0, aspect));
  }
  const int cell = (kWidthPx - 2 * kMarginPx - (columns - 1) * kGapPx) / columns;
  return {
      columns, static_cast<int>(views.size()), cell, static_cast<int>(std::lround(tallest * cell))};
}

Image FitInto(const Image& picture, int width, int height) {
  const double scale = std::min(static_cast<double>(width) / picture.width,
                                static_cast<double>(height) / picture.height);
  return Resize(picture,
                std::max(1, static_cast<int>(scale * picture.width)),
                std::max(1, static_cast<int>(scale * picture.height)));
}

class SheetPainter {
 public:
  explicit SheetPainter(int height) : canvas_(kWidthPx, height, 3) {
    DrawBox(0, 0, kWidthPx, height, kPaper, &canvas_);
  }

  int y = kMarginPx;

  void Line(const std::string& text, int size, const DrawColor& color) {
    DrawText(
        FittingText(text, size, kWidthPx - 2 * kMarginPx), kMarginPx, y, size, color, &canvas_);
    y += size + kGapPx;
  }

  void Views(const std::vector<SheetView>& views, const Grid& grid, bool aside) {
    for (int i = 0; i < grid.count; ++i) {
      const std::string rank = aside ? "" : std::to_string(i + 1) + "  ";
      Cell(views[i], rank, grid.X(i), y + grid.Y(i), grid.cell_px, grid.picture_px, aside);
    }
    y += grid.Height();
  }

  Image Take() { return std::move(canvas_); }

 private:
  void Cell(const SheetView& view,
            const std::string& rank,
            int x,
            int top,
            int width,
            int height,
            bool aside) {
    if (view.chosen) {
      DrawBox(x - kFramePx,
              top - kFramePx,
              width + 2 * kFramePx,
              height + 2 * kFramePx + 2 * kLinePx,
              kChosen,
              &canvas_);
    }
    if (!view.thumbnail.Empty()) {
      const Image picture = FitInto(view.thumbnail, width, height);
      DrawPicture(picture,
                  x + (width - picture.width) / 2,
                  top + (height - picture.height) / 2,
                  aside ? kAsideStrength : 1.0f,
                  &canvas_);
    }
    const DrawColor& ink = aside ? kFaint : kInk;
    DrawText(
        FittingText(rank + view.name, kTextPx, width), x, top + height + 6, kTextPx, ink, &canvas_);
    DrawText(FittingText(view.note, kTextPx, width),
             x,
             top + height + 6 + kLinePx,
             kTextPx,
             view.chosen ? kInk : kFaint,
             &canvas_);
  }

  Image canvas_;
};

std::string More(int count) { return "and " + std::to_string(count) + " more"; }

}  // namespace

Image DrawContactSheet(const ContactSheet& sheet) {
  if (sheet.ranked.empty()) throw InvalidArgument("a contact sheet needs at least one view");
  const int columns = std::clamp(
      static_cast<int>(std::ceil(std::sqrt(1.6 * static_cast<double>(sheet.ranked.size())))),
      kMinColumns,
      kMaxColumns);
  const Grid ranked = LayOutGrid(sheet.ranked, columns);
  const Grid aside = LayOutGrid(sheet.set_aside, kAsideColumns);
  const int line = kTextPx + kGapPx;
  SheetPainter painter(2 * kMarginPx + kTitlePx + line + 2 * kGapPx + ranked.Height() + line +
                       (sheet.set_aside.empty() ? 0 : 2 * line + aside.Height()));
  painter.Line(sheet.title, kTitlePx, kInk);
  painter.Line(sheet.subtitle, kTextPx, kFaint);
  painter.y += kGapPx;
  painter.Views(sheet.ranked, ranked, /*aside=*/false);
  painter.Line(sheet.ranked_left_out > 0 ? More(sheet.ranked_left_out) : "", kTextPx, kFaint);
  if (!sheet.set_aside.empty()) {
    painter.Line("Set aside", kTextPx, kInk);
    painter.Views(sheet.set_aside, aside, /*aside=*/true);
    if (sheet.set_aside_left_out > 0) painter.Line(More(sheet.set_aside_left_out), kTextPx, kFaint);
  }
  return painter.Take();
}

}  // namespace color3d
