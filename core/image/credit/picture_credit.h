// Licence and provenance of the colours of a picture, inside its file: as text of PNG (iTXt), as
// XMP, and as IPTC in JPEG, so that archives and picture programs show them. Pure functions,
// thread-safe.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace color3d {

// Who made the colours. All texts are UTF-8 of one line; empty ones are left out.
struct PictureCredit {
  std::string colored_by;
  std::string key_view_by;
  std::string source;  // of the monochrome original, e.g. an archive and its number
  std::string licence;
  std::string software = "Color3D";

  // Whether nobody and nothing is named.
  bool IsEmpty() const;
  // Throws Error{kInvalidArgument} for a text of more than 500 bytes or with control characters.
  void Validate() const;
};

// "Coloured by A. Key view by B. Original: C. Licence: D. Colours are inferred."
std::string CreditText(const PictureCredit& credit);

// Returns the PNG or JPEG with the credit in place of an earlier one; its pixels are untouched.
// Throws Error{kInvalidArgument} with `name` for other files, damaged ones, and as Validate.
std::string AddCredit(std::string_view picture,
                      const PictureCredit& credit,
                      const std::string& name);

// Texts in a PNG or JPEG, in the order of the file: the keyword of a PNG text, "XMP", or the data
// set of IPTC ("2:120"), each with its text. Those that are compressed are left out. Throws
// Error{kInvalidArgument} with `name` as AddCredit.
std::vector<std::pair<std::string, std::string>> ReadPictureTexts(std::string_view picture,
                                                                  const std::string& name);

}  // namespace color3d
