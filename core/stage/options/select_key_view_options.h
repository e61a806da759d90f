// Options of the stage select_key_view.
#pragma once

#include <string>

#include "core/keyview/select.h"

namespace color3d {

struct SelectKeyViewOptions {
  KeyViewOptions selection;
  std::string view;      // for KeyViewStrategy::kManual: name or unique file stem
  std::string encoder;   // weights by name in StageContext::Model; empty: the embedded encoder
  std::string features;  // CLIP weights by name; empty: the encoder's features
};

}  // namespace color3d
