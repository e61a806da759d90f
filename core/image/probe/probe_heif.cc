#include <algorithm>
#include <iterator>
#include <set>

#include "core/image/probe/heif_boxes.h"
#include "core/image/probe/probe_formats.h"

namespace color3d::probe_internal {
namespace {

constexpr std::string_view kBrands[] = {
    "heic", "heix", "heim", "heis", "hevc", "hevx", "mif1", "msf1", "avif", "avis"};
constexpr size_t kMaxParts = 4096;  // pictures that one is put together from

bool IsBrand(std::string_view brand) {
  return std::find(std::begin(kBrands), std::end(kBrands), brand) != std::end(kBrands);
}

// Checks the item's bytes in this file, and those of all items that form it.
void CheckItem(const ProbeContext& context,
               const HeifBoxes& boxes,
               uint32_t id,
               std::set<uint32_t>* checked) {
  if (!checked->insert(id).second) return;
  if (checked->size() > kMaxParts) throw context.Damaged("it has too many parts");
  const auto found = boxes.items.find(id);
  if (found == boxes.items.end()) throw context.Damaged("a part of the picture is not listed");
  const HeifItem& item = found->second;
  if (item.data_reference != 0) {
    throw InvalidArgument(
        "{} keeps its picture in another file, which is not read; save it as JPEG",
        context.file_name);
  }
  if (item.type == "av01") {
    throw InvalidArgument("{} is an AVIF picture, which cannot be read; convert it to PNG",
                          context.file_name);
  }
  const bool is_derived = item.type == "grid" || item.type == "iden" || item.type == "iovl";
  const bool is_coded = item.type == "hvc1" || item.type == "hev1";
  if ((!is_coded && !is_derived) || item.is_protected || item.construction > 1) {
    throw InvalidArgument("{} is a HEIC picture of an unsupported kind; convert it to JPEG or PNG",
                          context.file_name);
  }
  if (!item.is_whole) throw context.Truncated("a part of the picture lies behind its end");
  if (is_coded || item.type == "grid") {
    if (item.parts.empty()) throw context.Damaged("it does not say where its picture lies");
  }
  for (const uint32_t part : item.made_of) CheckItem(context, boxes, part, checked);
}

struct Outline {
  int64_t width = 0;
  int64_t height = 0;
  uint32_t bits = 8;
  std::string_view profile;
};

// Properties of the picture, in order.
Outline ReadOutline(const HeifBoxes& boxes, const HeifItem& item) {
  Outline outline;
  for (const size_t index : item.properties) {
    if (index >= boxes.properties.size()) continue;
    const auto& [type, body] = boxes.properties[index];
    const ByteReader reader(body);
    if (type == "ispe") {
      outline.width = reader.U32(4);
      outline.height = reader.U32(8);
    } else if (type == "pixi") {
      outline.bits = std::max(8u, reader.U8(5));
    } else if (type == "irot" && reader.U8(0) % 2 == 1) {
      std::swap(outline.width, outline.height);
    } else if (type == "clap" && reader.U32(4) > 0 && reader.U32(12) > 0) {
      outline.width = reader.U32(0) / reader.U32(4);
      outline.height = reader.U32(8) / reader.U32(12);
    } else if (type == "colr" && (body.starts_with("prof") || body.starts_with("rICC"))) {
      outline.profile = body.substr(4);
    }
  }
  return outline;
}

HeifBoxes BoxesOf(std::string_view bytes) {
  static const ImageLimits limits;
  static const std::string name;
  try {
    return ReadHeifBoxes({bytes, name, limits});
  } catch (const Error&) {
    return {};
  }
}

}  // namespace

bool IsHeif(std::string_view bytes) {
  if (bytes.substr(std::min<size_t>(bytes.size(), 4), 4) != "ftyp") return false;
  const ByteReader reader(bytes);
  const size_t end = std::min<size_t>({reader.U32(0), bytes.size(), 256});
  for (size_t at = 8; at + 4 <= end; at += at == 8 ? 8 : 4) {
    if (IsBrand(bytes.substr(at, 4))) return true;
  }
  return false;
}

ImageInfo ProbeHeif(const ProbeContext& context) {
  const HeifBoxes boxes = ReadHeifBoxes(context);
  const auto primary = boxes.items.find(boxes.primary);
  if (primary == boxes.items.end()) throw context.Damaged("it names no picture");
  std::set<uint32_t> checked;
  CheckItem(context, boxes, boxes.primary, &checked);
  if (!ReadsHeif()) {
    throw InvalidArgument(
        "{} is a HEIC picture, which this build cannot read (it was built without libheif); "
        "convert it to JPEG, e.g. with `heif-convert`",
        context.file_name);
  }
  const Outline outline = ReadOutline(boxes, primary->second);
  context.CheckSize(outline.width, outline.height);
  ImageInfo info;
  info.format = ImageFormat::kHeif;
  info.width = static_cast<int>(outline.width);
  info.height = static_cast<int>(outline.height);
  info.bits_per_channel = static_cast<int>(outline.bits);
  info.channels = 3;
  return info;
}

std::string_view FindHeifExif(std::string_view bytes) {
  for (const auto& [id, item] : BoxesOf(bytes).items) {
    if (item.type != "Exif" || item.parts.size() != 1) continue;
    const std::string_view part = item.parts[0];
    const size_t skipped = size_t{4} + ByteReader(part).U32(0);
    return part.substr(std::min(part.size(), skipped));
  }
  return {};
}

std::string_view FindHeifProfile(std::string_view bytes) {
  const HeifBoxes boxes = BoxesOf(bytes);
  const auto primary = boxes.items.find(boxes.primary);
  return primary == boxes.items.end() ? std::string_view()
                                      : ReadOutline(boxes, primary->second).profile;
}

}  // namespace color3d::probe_internal
