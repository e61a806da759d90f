// The credit of a picture as an XMP packet. For this folder only.
#pragma once

#include <string>

#include "core/image/credit/picture_credit.h"

namespace color3d {

std::string XmpOf(const PictureCredit& credit);

}  // namespace color3d
