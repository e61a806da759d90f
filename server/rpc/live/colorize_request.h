// Checks a ColorizeImages request and resolves its names to blobs. May block on the store.
#pragma once

#include "color3d/internal/v1/inference.pb.h"
#include "color3d/v1/colorizer.pb.h"
#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

// Fills the call to the worker (moving the picture out of `request`) and, in `response`,
// request_id, colorizer and scene. Throws ServiceError: no such colorizer, a scene without one, a
// colorizer of another scene, a missing blob, a picture of more than 3 MiB.
void ResolveColorizeRequest(const RpcParts& parts,
                            const ProjectStore& store,
                            v1::ColorizeImagesRequest* request,
                            internal::v1::ColorizeImageRequest* call,
                            v1::ColorizeImagesResponse* response);

}  // namespace color3d
