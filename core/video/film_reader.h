// Random access to the frames of a video file, decoded on demand: memory does not grow with the
// length of the film (FILM.md "Film").
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"

namespace color3d {

struct FilmFacts {
  int width = 0;  // px, as displayed: upright, with square pixels
  int height = 0;
  int quarter_turns = 0;  // clockwise rotation stored in the file and applied by Read; 0..3
  std::string codec;      // FFmpeg's name, e.g. "h264"
  double seconds = 0.0;   // from the start of the first frame to the end of the last one
  double first_s = 0.0;   // timestamp of the first frame in the file, the origin of times()
  bool constant_rate = true;
  bool has_sound = false;
  bool interlaced = false;  // the first undamaged frame is; Read then takes one field of each
  std::string hdr;          // "PQ" or "HLG": Read maps its tones to SDR; empty: no HDR
  double peak_nits = 0.0;   // HDR only: luminance that becomes white, cd/m2
  // Notes for the user on how the film is read, one line each; each continues the film's name: "is
  // ..."
  std::vector<std::string> notes;
};

// Not thread-safe.
class FilmReader {
 public:
  // Reads the file once, without decoding it, for its times. Of several picture streams it takes
  // the one marked as default, else the largest. Opens no other file, even if the film references
  // one. `cancel` may be null; it must outlive this object and ends every call with
  // Error{kCancelled}. Throws Error{kInvalidArgument} with the file's name if it is not a film in a
  // supported container that FFmpeg's libraries can decode, has sound only, or has frames of more
  // than 8192 px; Error{kNotFound} if it does not exist.
  explicit FilmReader(std::filesystem::path file, const CancellationToken* cancel = nullptr);
  ~FilmReader();
  FilmReader(FilmReader&&) noexcept;
  FilmReader& operator=(FilmReader&&) noexcept;

  const FilmFacts& facts() const;
  // Time of each frame: seconds from the first one, strictly ascending, never empty. Frames with
  // the same timestamp count once; frames cut off by the edit list are omitted. H.264 in AVI has no
  // timestamps: its frames are ordered by their numbers and may be a frame or two late against the
  // sound. Concatenated recordings (MPEG-TS, MPEG-PS) follow each other without a gap; only the
  // first one has sound.
  const std::vector<double>& times() const;

  // Returns sRGB in 0..1 (HDR tones are mapped), 3 channels, facts().width x facts().height. The
  // frame after the last one read is the cheapest; others are decoded from the preceding key frame.
  // Throws Error{kDataLoss} with the frame and its time if the frame, or one since the last key
  // frame that it may be predicted from, is flagged by the decoder, refused or missing; other
  // frames may still be intact. Frames that the decoder conceals without an error, or predicts from
  // a frame missing from the file without a trace, are returned.
  Image Read(int frame);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace color3d
