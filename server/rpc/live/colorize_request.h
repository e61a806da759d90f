// What a ColorizeImages request asks for: checked, and with names resolved to blobs. May block on
// the store.
#pragma once

#include "color3d/internal/v1/inference.pb.h"
#include "color3d/v1/colorizer.pb.h"
#include "server/rpc/calls/rpc_parts.h"

namespace color3d {

// Fills the call to the worker (taking the picture's bytes out of `request`), and in `response`
// what is known before: request_id, colorizer, scene. Throws ServiceError: no such colorizer, a
// scene without one, a colorizer of another scene, a missing blob, a picture of more than 3 MiB.
void ResolveColorizeRequest(const RpcParts& parts,
                            const ProjectStore& store,
                            v1::ColorizeImagesRequest* request,
                            internal::v1::ColorizeImageRequest* call,
                            v1::ColorizeImagesResponse* response);

}  // namespace color3d
