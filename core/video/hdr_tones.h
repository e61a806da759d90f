// Films of high dynamic range (HDR) as pictures of the usual one (FILM.md "Film"). Pure.
#pragma once

#include <array>
#include <vector>

#include "core/base/image.h"

namespace color3d {

// How the samples of a film stand for light.
enum class FilmTransfer {
  kUsual,  // taken as sRGB
  kPq,     // SMPTE ST 2084: HDR10, HDR10+, Dolby Vision
  kHlg     // ARIB STD-B67
};

// Light of this much, cd/m2, is white in the usual range (BT.2408: what a sheet of paper has).
inline constexpr double kHdrWhiteNits = 203.0;
// The brightest that a film shows where it does not say so, and that of every HLG film.
inline constexpr double kUsualPeakNits = 1000.0;

// 0..1 of PQ as light in cd/m2, and back.
double PqNits(double value);
double PqValue(double nits);

// Light of an HDR film, in cd/m2, within 0..kHdrWhiteNits: the curve of BT.2390 (5.4.1), which
// leaves dark and middle tones as they are and bends brighter ones. `peak_nits` becomes white.
double ToneMappedNits(double nits, double peak_nits);

// Thread-safe once made.
class HdrTones {
 public:
  // `is_wide`: the primaries are those of BT.2020, else they are taken for BT.709's. `peak_nits` is
  // for PQ, > 0.
  HdrTones(FilmTransfer transfer, bool is_wide, double peak_nits);

  // In place: 3 channels in 0..1 as the film codes them, as sRGB in 0..1. Tones are mapped by the
  // brightest channel, so that hues stay; what BT.709's primaries cannot show is clipped.
  void Apply(Image* rgb) const;

 private:
  const FilmTransfer transfer_;
  const bool is_wide_;
  std::vector<float> light_;  // of a sample, in steps of 1/65535: linear; cd/m2 for PQ
  std::vector<float> gain_;   // by the fourth root of light: from cd/m2 to linear 0..1
  std::vector<float> srgb_;   // by the square root of linear light in 0..1
};

}  // namespace color3d
