// Converts BackendInfo to types of core. Internal to this folder.
#pragma once

#include <string>

#include "color3d/backend/v1/backend.pb.h"
#include "core/keycolor/external/remote.h"

namespace color3d {

// Unknown capabilities are left out.
RemoteInfo InfoFromProto(const backend::v1::BackendInfo& info);

}  // namespace color3d
