// The boxes of a HEIF file (ISO 23008-12) with the type and the parts of its picture. For this
// folder only. Plain C++, no codec, safe on hostile input.
#pragma once

#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

#include "core/image/probe/probe_formats.h"

namespace color3d::probe_internal {

struct HeifItem {
  std::string_view type;  // "hvc1", "grid", "Exif", ...; empty: not stated
  bool is_protected = false;
  uint32_t data_reference = 0;          // not 0: in another file
  uint32_t construction = 0;            // 0: in the file, 1: in the idat box, 2: in another item
  std::vector<std::string_view> parts;  // its bytes, with construction 0 and 1
  bool is_whole = true;                 // all parts lie inside the file
  std::vector<size_t> properties;       // indices of HeifBoxes::properties, in order
  std::vector<uint32_t> made_of;        // items that form a derived picture
};

struct HeifProperty {
  std::string_view type;  // "ispe", "irot", "colr", ...
  std::string_view body;
};

struct HeifBoxes {
  uint32_t primary = 0;
  std::map<uint32_t, HeifItem> items;
  std::vector<HeifProperty> properties;
};

// Throws Error{kInvalidArgument} if boxes are truncated or inconsistent.
HeifBoxes ReadHeifBoxes(const ProbeContext& context);

}  // namespace color3d::probe_internal
