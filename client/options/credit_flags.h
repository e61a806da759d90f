// Flags for the licence and provenance of colours that are written into pictures, and the writing.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "core/image/credit/picture_credit.h"

namespace color3d::client {

struct CreditFlags {
  PictureCredit credit;
  bool caption = false;  // also a visible line below each picture

  bool IsGiven() const { return caption || !credit.IsEmpty(); }
};

// Adds --colored-by, --key-view-by, --source and --licence; `with_caption`: --caption, too, which
// changes the sizes of pictures. Requires: `flags` outlives `app`.
void DeclareCreditFlags(CLI::App& app, CreditFlags* flags, bool with_caption);

// Whether a result is a picture in colour for people: the coloured key views, renders, frames.
bool IsColoredPicture(const std::string& artifact);

// The PNG or JPEG with the credit, and with a caption if asked for. Throws
// Error{kInvalidArgument} with `name`.
std::string WithCredit(const std::string& picture,
                       const CreditFlags& flags,
                       const std::string& name);

// Writes the credit into the pictures in colour among folder/NAME, if any flag is given.
void CreditPictures(const std::filesystem::path& folder,
                    const std::vector<std::string>& names,
                    const CreditFlags& flags);

}  // namespace color3d::client
