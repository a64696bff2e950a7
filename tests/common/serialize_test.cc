// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/serialize.h"

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "validation_error.h"

namespace dual_proxy {

enum class Fruit { kApple, kPear };

template <>
struct EnumStrings<Fruit> {
  static constexpr std::pair<Fruit, const char*> kValues[] = {
      {Fruit::kApple, "apple"}, {Fruit::kPear, "pear"}};
};

namespace {

struct Basket {
  Fruit fruit{Fruit::kApple};

  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "Basket", "fruit", &fruit);
  }
};

// Keeps what it is shown, and sets it to `replacement` if there is one.
struct StringArchive {
  void Visit(const NameValue<std::string>& field) {
    seen[field.name()] = *field.value();
    if (!replacement.empty()) *field.value() = replacement;
  }

  std::map<std::string, std::string> seen;
  std::string replacement;
};

TEST(SerializeTest, NameValueKeepsNameAddressAndWhetherItIsRequired) {
  double x = 3;
  const NameValue<double> optional = MakeNameValue("x", &x);
  EXPECT_STREQ(optional.name(), "x");
  EXPECT_EQ(optional.value(), &x);
  EXPECT_FALSE(optional.required());
  EXPECT_TRUE(MakeRequired("x", &x).required());
}

TEST(SerializeTest, EnumIsVisitedByItsName) {
  Basket basket{Fruit::kPear};
  StringArchive archive;
  basket.Serialize(&archive);
  EXPECT_EQ(archive.seen.at("fruit"), "pear");
  EXPECT_EQ(basket.fruit, Fruit::kPear);
  archive.replacement = "apple";
  basket.Serialize(&archive);
  EXPECT_EQ(basket.fruit, Fruit::kApple);
}

TEST(SerializeTest, UnknownEnumNameIsAnErrorAndChangesNothing) {
  Basket basket{Fruit::kPear};
  StringArchive archive{.seen = {}, .replacement = "plum"};
  EXPECT_EQ(InvalidArgument([&] { basket.Serialize(&archive); }),
            "Basket: field `fruit` expected one of \"apple\", \"pear\", got "
            "\"plum\"");
  EXPECT_EQ(basket.fruit, Fruit::kPear);
}

TEST(SerializeTest, EnumNames) {
  EXPECT_STREQ(EnumToString(Fruit::kPear), "pear");
  EXPECT_STREQ(EnumToString(static_cast<Fruit>(7)), "?");
  EXPECT_EQ(EnumFromString<Fruit>("apple"), Fruit::kApple);
  EXPECT_EQ(EnumFromString<Fruit>("Apple"), std::nullopt);
}

static_assert(Serializable<Basket>);
static_assert(!Serializable<double>);
static_assert(!Serializable<std::vector<Basket>>);

}  // namespace
}  // namespace dual_proxy
