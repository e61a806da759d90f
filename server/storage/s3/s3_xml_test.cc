#include "server/storage/s3/s3_xml.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(S3XmlTest, FindsElementsAndReplacesEntities) {
  constexpr char kList[] =
      "<?xml version=\"1.0\"?>\n<ListBucketResult "
      "xmlns=\"http://s3.amazonaws.com/doc/2006-03-01/\">"
      "<Name>b</Name><KeyCount>2</KeyCount><Key/>"
      "<Contents><Key>a&amp;b&#x26;&#39;</Key><ETag>&quot;x&quot;</ETag></Contents>"
      "<Contents><Key>c &lt; d</Key></Contents></ListBucketResult>";
  const auto contents = XmlElements(kList, "Contents");
  ASSERT_EQ(contents.size(), 2u);
  EXPECT_EQ(XmlText(contents[0], "Key"), "a&b&'");
  EXPECT_EQ(XmlText(contents[0], "ETag"), "\"x\"");
  EXPECT_EQ(XmlText(contents[1], "Key"), "c < d");
  EXPECT_EQ(XmlText(kList, "Key"), "") << "an empty element";
  EXPECT_EQ(XmlText(kList, "Nam"), "") << "a name that another begins with";
  EXPECT_EQ(XmlText(kList, "Missing"), "");
}

TEST(S3XmlTest, BrokenAnswersHaveNoElements) {
  for (const char* text :
       {"", "<", "<Key", "<Key>", "<Key>a", "<Key>a</Ke", "</Key>", "&<Key", "<<>>"}) {
    EXPECT_EQ(XmlText(text, "Key"), "") << text;
    EXPECT_TRUE(XmlElements(text, "Key").empty()) << text;
  }
  EXPECT_EQ(XmlText("<Key>&bad; &#; &#xZZ; &</Key>", "Key"), "&bad; &#; &#xZZ; &");
}

TEST(S3XmlTest, EscapesReservedCharacters) {
  EXPECT_EQ(XmlEscape("\"a\"<b>&'"), "&quot;a&quot;&lt;b&gt;&amp;&apos;");
}

}  // namespace
}  // namespace color3d
