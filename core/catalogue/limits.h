// Limits that the client, the API and the stages share.
#pragma once

namespace color3d {

// Key views beside the first one. As max_count of CarryColorSpec.further_key_views in stage.proto.
inline constexpr int kMaxAdditionalKeyViews = 16;

}  // namespace color3d
