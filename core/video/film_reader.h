// Frames of a video file, decoded when they are asked for: memory does not grow with the length of
// the film (FILM.md "Film").
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"

namespace color3d {

struct FilmFacts {
  int width = 0;  // px, as people see it: upright, of square pixels
  int height = 0;
  int quarter_turns = 0;  // clockwise, that the file asks for and Read has done; 0..3
  std::string codec;      // FFmpeg's name, e.g. "h264"
  double seconds = 0.0;   // from the first frame's beginning to the last one's end
  double first_s = 0.0;   // the file's own time of the first frame, which times() count from
  bool constant_rate = true;
  bool has_sound = false;
  bool interlaced = false;  // its first whole frame is; of each frame Read then takes one field
  std::string hdr;          // "PQ" or "HLG": Read maps its tones to the usual range; empty: no HDR
  double peak_nits = 0.0;   // of HDR: cd/m2 that become white
  // What a user should know of how the film is read, a line each; they go on from its name: "is
  // ..."
  std::vector<std::string> notes;
};

// Not thread-safe.
class FilmReader {
 public:
  // Reads the file once through, without decoding it, for its times. Of several streams of pictures
  // the one that is marked as the default counts, else the largest. No other file is opened,
  // whatever the film names. `cancel` may be null; it outlives this object and ends every call with
  // Error{kCancelled}. Throws Error{kInvalidArgument} that names the file when it is no film in one
  // of our containers that FFmpeg's libraries can decode, has sound only, or frames of more than
  // 8192 px; Error{kNotFound} when it is not there.
  explicit FilmReader(std::filesystem::path file, const CancellationToken* cancel = nullptr);
  ~FilmReader();
  FilmReader(FilmReader&&) noexcept;
  FilmReader& operator=(FilmReader&&) noexcept;

  const FilmFacts& facts() const;
  // When each frame is shown: s from the first one, strictly ascending, never empty. Frames that
  // the file gives one time count once, those that its edit list cuts off do not. H.264 in AVI has
  // no times of its own: its frames are put in order by their numbers, and may come a frame or two
  // late against the sound. Of recordings put behind one another (MPEG-TS, MPEG-PS) each begins
  // where the one before it ends; sound has only the first one.
  const std::vector<double>& times() const;

  // sRGB in 0..1 (tones of HDR are mapped), 3 channels, facts().width x facts().height. The frame
  // after the last one read costs the least; others are decoded from the key frame before them.
  // Throws Error{kDataLoss} that names the frame and its time when it is damaged (others may still
  // be whole): it, or one since the last key frame that it may be predicted from, is flagged by the
  // decoder, refused or missing. What the decoder makes up without a word, and what is predicted
  // from a frame that the file has lost without a trace, is not known to be damaged and handed
  // over.
  Image Read(int frame);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace color3d
