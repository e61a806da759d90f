// Jobs that make more of a coloured scene: files of other formats, movies, views.
#pragma once

#include <string>
#include <vector>

#include "client/lib/connection.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

// A spec on the scene that `of` coloured, with its results as inputs and no stage yet.
v1::JobSpec SpecOn(Connection& connection, const v1::Job& of);

// Sets the longer side of pictures as `of` worked with, unless it is the default.
void SetSideOf(const v1::Job& of, v1::RenderSpec* render);

// The export of these formats alone: names of switches of ExportSpec ("spz"). Throws
// Error{kInvalidArgument} with the names that there are for others.
v1::ExportSpec ExportOf(const std::vector<std::string>& formats);

// The artifacts that ExportOf(formats) writes; a name that ends in '/' is a folder.
std::vector<std::string> ArtifactsOfFormats(const std::vector<std::string>& formats);

}  // namespace color3d::client
