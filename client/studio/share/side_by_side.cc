#include "client/studio/share/side_by_side.h"

#include <algorithm>

#include "core/base/parallel.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/draw.h"
#include "core/video/film_reader.h"
#include "core/video/mp4_writer.h"

namespace color3d::client {
namespace {

constexpr int kThreads = 2;
constexpr int kTicks = 30'000;  // a second

Image WithoutColor(const Image& frame) {
  Image gray = LuminanceFromSrgb(frame);
  for (float& value : gray.data) value = static_cast<float>(GrayFromLuminance(value));
  return gray;
}

}  // namespace

void WriteSideBySide(const std::filesystem::path& movie,
                     const std::filesystem::path& to,
                     const CancellationToken& cancel) {
  FilmReader reader(movie, &cancel);
  const FilmFacts& facts = reader.facts();
  const double scale = std::min({1.0,
                                 kMaxMovieSidePx / 2.0 / facts.width,
                                 static_cast<double>(kMaxMovieSidePx) / facts.height});
  const int half = std::max(kMinMovieSidePx, static_cast<int>(scale * facts.width));
  const int height = std::max(kMinMovieSidePx, static_cast<int>(scale * facts.height) / 2 * 2);
  Mp4Options options;
  options.width = 2 * half;
  options.height = height;
  options.ticks_per_second = kTicks;
  if (facts.has_sound) {
    options.sound = SoundPart{movie, facts.first_s, facts.first_s + facts.seconds};
  }
  options.cancel = &cancel;
  Mp4Writer writer(to, options);
  ThreadPool pool(kThreads);
  const std::vector<double>& times = reader.times();
  Image both(options.width, height, 3);
  for (size_t i = 0; i < times.size(); ++i) {
    cancel.ThrowIfCancelled();
    Image frame = reader.Read(static_cast<int>(i));
    if (frame.width != half || frame.height != height) frame = Resize(frame, half, height);
    DrawPicture(WithoutColor(frame), 0, 0, 1.0f, &both);
    DrawPicture(frame, half, 0, 1.0f, &both);
    const double end = i + 1 < times.size() ? times[i + 1] : facts.seconds;
    writer.AddAt(times[i], std::max(end - times[i], 1.0 / kTicks), both, pool);
  }
  writer.Finish();
}

}  // namespace color3d::client
