// Tone mapping of high dynamic range (HDR) films to SDR (FILM.md "Film"). Pure.
#pragma once

#include <array>
#include <vector>

#include "core/base/image.h"

namespace color3d {

// Transfer function of a film.
enum class FilmTransfer {
  kUsual,  // interpreted as sRGB
  kPq,     // SMPTE ST 2084: HDR10, HDR10+, Dolby Vision
  kHlg     // ARIB STD-B67
};

// Luminance of SDR white, cd/m2 (BT.2408: that of a sheet of paper).
inline constexpr double kHdrWhiteNits = 203.0;
// Peak luminance of films that do not state it, and of every HLG film.
inline constexpr double kUsualPeakNits = 1000.0;

// PQ value 0..1 to light in cd/m2, and back.
double PqNits(double value);
double PqValue(double nits);

// Maps light of an HDR film in cd/m2 to 0..kHdrWhiteNits with the curve of BT.2390 (5.4.1), which
// keeps dark and middle tones and compresses bright ones. `peak_nits` becomes white.
double ToneMappedNits(double nits, double peak_nits);

// Thread-safe after construction.
class HdrTones {
 public:
  // `is_wide`: the primaries are those of BT.2020, else BT.709. `peak_nits` applies to PQ, > 0.
  HdrTones(FilmTransfer transfer, bool is_wide, double peak_nits);

  // Converts 3 channels in 0..1 from the film's encoding to sRGB in place. Maps tones by the
  // brightest channel to keep hues; clips colours outside BT.709.
  void Apply(Image* rgb) const;

 private:
  const FilmTransfer transfer_;
  const bool is_wide_;
  std::vector<float> light_;  // by sample, in steps of 1/65535: linear; cd/m2 for PQ
  std::vector<float> gain_;   // by the fourth root of light: from cd/m2 to linear 0..1
  std::vector<float> srgb_;   // by the square root of linear light in 0..1
};

}  // namespace color3d
