#include "server/storage/s3/s3_xml.h"

#include <array>
#include <charconv>
#include <utility>

namespace color3d {
namespace {

constexpr std::array<std::pair<std::string_view, char>, 5> kEntities{
    {{"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}, {"&amp;", '&'}}};

// Replaces named entities, and numbered ones of ASCII.
std::string Unescape(std::string_view text) {
  std::string plain;
  while (!text.empty()) {
    const size_t end = text.front() == '&' ? text.find(';') : text.npos;
    const std::string_view entity = end == text.npos ? "" : text.substr(0, end + 1);
    char character = text.front();
    bool is_known = false;
    for (const auto& [name, meaning] : kEntities) {
      if (entity == name) character = meaning, is_known = true;
    }
    if (!is_known && entity.starts_with("&#")) {
      const bool is_hex = entity.size() > 3 && entity[2] == 'x';
      const char* begin = entity.data() + (is_hex ? 3 : 2);
      int number = 0;
      const auto [last, error] =
          std::from_chars(begin, entity.data() + entity.size() - 1, number, is_hex ? 16 : 10);
      is_known = error == std::errc() && *last == ';' && number > 0 && number < 128;
      if (is_known) character = static_cast<char>(number);
    }
    plain += character;
    text.remove_prefix(is_known ? entity.size() : 1);
  }
  return plain;
}

// Finds the first element; returns false if there is none. `rest`: what follows it.
bool FindElement(std::string_view xml,
                 std::string_view name,
                 std::string_view* content,
                 std::string_view* rest) {
  const std::string close = "</" + std::string(name) + ">";
  for (size_t at = xml.find('<'); at != xml.npos; at = xml.find('<', at + 1)) {
    if (xml.substr(at + 1, name.size()) != name) continue;
    const size_t after = at + 1 + name.size();
    const char next = after < xml.size() ? xml[after] : '\0';
    if (next != '>' && next != ' ' && next != '/') continue;
    const size_t begin = xml.find('>', after);
    if (begin == xml.npos) return false;
    if (xml[begin - 1] == '/') {
      *content = "";
      *rest = xml.substr(begin + 1);
      return true;
    }
    const size_t end = xml.find(close, begin);
    if (end == xml.npos) return false;
    *content = xml.substr(begin + 1, end - begin - 1);
    *rest = xml.substr(end + close.size());
    return true;
  }
  return false;
}

}  // namespace

std::string XmlText(std::string_view xml, std::string_view name) {
  std::string_view content, rest;
  return FindElement(xml, name, &content, &rest) ? Unescape(content) : "";
}

std::vector<std::string_view> XmlElements(std::string_view xml, std::string_view name) {
  std::vector<std::string_view> all;
  std::string_view content, rest;
  while (FindElement(xml, name, &content, &rest)) {
    all.push_back(content);
    xml = rest;
  }
  return all;
}

std::string XmlEscape(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    std::string_view entity;
    for (const auto& [name, meaning] : kEntities) {
      if (c == meaning) entity = name;
    }
    entity.empty() ? escaped.push_back(c) : static_cast<void>(escaped.append(entity));
  }
  return escaped;
}

}  // namespace color3d
