// Simple drawing for illustrations: text, boxes, insets. OpenCV inside, never in this interface.
// Clips everything to the canvas. Pure functions of their arguments.
#pragma once

#include <array>
#include <string>

#include "core/base/image.h"

namespace color3d {

using DrawColor = std::array<float, 3>;  // sRGB, 0..1

// A filled box; `canvas` has 3 channels.
void DrawBox(int x, int y, int width, int height, const DrawColor& color, Image* canvas);

// Draws `picture` (1 or 3 channels) with its upper left corner at (x, y); `strength` 0..1 blends it
// with the canvas.
void DrawPicture(const Image& picture, int x, int y, float strength, Image* canvas);

// One line of text in a sans-serif stroke font, capitals `height_px` high, its upper left corner at
// (x, y). The font has ASCII only: other characters become '?'.
void DrawText(
    const std::string& text, int x, int y, int height_px, const DrawColor& color, Image* canvas);
int TextWidth(const std::string& text, int height_px);
// Shortens the text in the middle ("IMG_20...17.jpg") until it is at most `width_px` wide.
std::string FittingText(const std::string& text, int height_px, int width_px);

}  // namespace color3d
