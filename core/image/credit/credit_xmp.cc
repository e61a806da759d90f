#include "core/image/credit/credit_xmp.h"

namespace color3d {
namespace {

// IPTC's word for pictures that an algorithm altered.
constexpr char kSourceType[] =
    "http://cv.iptc.org/newscodes/digitalsourcetype/algorithmicallyEnhanced";

std::string XmlText(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    switch (c) {
      case '&':
        safe += "&amp;";
        break;
      case '<':
        safe += "&lt;";
        break;
      case '>':
        safe += "&gt;";
        break;
      case '"':
        safe += "&quot;";
        break;
      default:
        safe += c;
    }
  }
  return safe;
}

std::string Element(const std::string& name, const std::string& text) {
  if (text.empty()) return "";
  return "  <" + name + ">" + XmlText(text) + "</" + name + ">\n";
}

// A text in no particular language.
std::string Alternatives(const std::string& name, const std::string& text) {
  if (text.empty()) return "";
  return "  <" + name + "><rdf:Alt><rdf:li xml:lang=\"x-default\">" + XmlText(text) +
         "</rdf:li></rdf:Alt></" + name + ">\n";
}

// The photographer is dc:creator, who is not known here; those who coloured contributed.
std::string Contributors(const PictureCredit& credit) {
  std::string people;
  const auto add = [&](const std::string& name, const char* part) {
    if (!name.empty()) people += "<rdf:li>" + XmlText(name) + " (" + part + ")</rdf:li>";
  };
  add(credit.colored_by, "colours");
  add(credit.key_view_by, "colours of the key view");
  if (people.empty()) return "";
  return "  <dc:contributor><rdf:Bag>" + people + "</rdf:Bag></dc:contributor>\n";
}

}  // namespace

std::string XmpOf(const PictureCredit& credit) {
  return "<?xpacket begin=\"\xEF\xBB\xBF\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n"
         "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n"
         "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n"
         " <rdf:Description rdf:about=\"\"\n"
         "   xmlns:dc=\"http://purl.org/dc/elements/1.1/\"\n"
         "   xmlns:photoshop=\"http://ns.adobe.com/photoshop/1.0/\"\n"
         "   xmlns:xmp=\"http://ns.adobe.com/xap/1.0/\"\n"
         "   xmlns:xmpRights=\"http://ns.adobe.com/xap/1.0/rights/\"\n"
         "   xmlns:Iptc4xmpExt=\"http://iptc.org/std/Iptc4xmpExt/2008-02-29/\">\n" +
         Contributors(credit) + Alternatives("dc:description", CreditText(credit)) +
         Alternatives("dc:rights", credit.licence) + Element("dc:source", credit.source) +
         Alternatives("xmpRights:UsageTerms", credit.licence) +
         Element("photoshop:Instructions", "Colours are inferred.") +
         Element("photoshop:Source", credit.source) + Element("xmp:CreatorTool", credit.software) +
         Element("Iptc4xmpExt:DigitalSourceType", kSourceType) +
         " </rdf:Description>\n</rdf:RDF>\n</x:xmpmeta>\n<?xpacket end=\"w\"?>";
}

}  // namespace color3d
