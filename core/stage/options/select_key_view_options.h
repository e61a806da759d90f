// Options of the stage select_key_view.
#pragma once

#include <string>

#include "core/keyview/select.h"

namespace color3d {

struct SelectKeyViewOptions {
  KeyViewOptions selection;
  std::string view;      // for KeyViewStrategy::kManual: name or unique file stem
  std::string encoder;   // name of weights in StageContext::Model; empty: embedded encoder
  std::string features;  // name of CLIP weights; empty: features of the encoder
};

}  // namespace color3d
