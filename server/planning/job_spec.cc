#include "server/planning/job_spec.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include "core/base/error.h"

namespace color3d {

std::string DeterministicBytes(const google::protobuf::Message& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&coded);
  }  // the destructor of the stream sets the length of the string
  return bytes;
}

v1::JobSpec ParseSpec(const std::string& bytes, const std::string& job_name) {
  v1::JobSpec spec;
  if (!spec.ParseFromString(bytes)) {
    throw Error(ErrorCode::kDataLoss, "the stored spec of {} is damaged", job_name);
  }
  return spec;
}

google::protobuf::Message* MutableStage(v1::JobSpec* spec, const std::string& kind) {
  const google::protobuf::FieldDescriptor* field = spec->GetDescriptor()->FindFieldByName(kind);
  if (field == nullptr) {
    throw Error(ErrorCode::kInternal, "a job's spec has no stage '{}'", kind);
  }
  return spec->GetReflection()->MutableMessage(spec, field);
}

}  // namespace color3d
