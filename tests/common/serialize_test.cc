// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/serialize.h"

#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

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

  void Validate() const { ValidateFields("Basket", *this); }

  template <typename Archive>
  void Serialize(Archive* a) {
    VisitEnum(a, "Basket", "fruit", &fruit, "what is in it");
  }
};

struct Coin {
  double value{1};

  void Validate() const { ValidateFields("Coin", *this); }

  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("value", &value, Above(0), "euro", "printed on it"));
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

struct Purse {
  std::optional<double> notes;
  std::optional<Eigen::Vector2d> coins;

  void Validate() const { ValidateFields("Purse", *this); }

  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("notes", &notes, Above(0), "euro", "if there are any"));
    a->Visit(Field("coins", &coins, Between(0, 9), "", "of two kinds"));
  }
};

struct Stall {
  Eigen::Vector2d place{1, 2};
  double price{3};
  int left{4};
  Basket basket;
  std::vector<Coin> till;

  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("place", &place, Finite(), "m", "in the market"));
    a->Visit(Field("price", &price, Above(0), "euro", "of a fruit"));
    a->Visit(Field("left", &left, Between(0, 9), "", "fruits"));
    VisitEmbedded(a, "basket", &basket, "for the rest");
    a->Visit(Field("till", &till, "change"));
  }
};

TEST(SerializeTest, AnOptionalFieldIsCheckedIfItIsThere) {
  Purse dut;
  EXPECT_EQ(ValidationError(dut), "no exception");
  dut.notes = -5;
  EXPECT_EQ(ValidationError(dut),
            "Purse: field `notes` expected a finite value > 0, got -5");
  dut.notes = 5;
  dut.coins = Eigen::Vector2d(3, 10);
  EXPECT_EQ(ValidationError(dut),
            "Purse: field `coins[1]` expected a number in [0, 9], got 10");
}

TEST(SerializeTest, AFieldKeepsWhatIsSaidOfIt) {
  double x = 3;
  FieldValue<double> dut = Field("x", &x, Above(0), "m", "of a thing");
  EXPECT_STREQ(dut.name(), "x");
  EXPECT_EQ(dut.value(), &x);
  EXPECT_EQ(dut.notes().range->low.value, 0);
  EXPECT_STREQ(dut.notes().unit, "m");
  EXPECT_STREQ(dut.notes().meaning, "of a thing");
  EXPECT_FALSE(dut.required());
  EXPECT_TRUE(dut.Required().required());
  EXPECT_FALSE(Field("x", &x, "of a thing").notes().range);
}

TEST(SerializeTest, EveryKindOfFieldIsValidated) {
  const auto error = [](const auto& change) {
    Stall stall;
    change(&stall);
    return InvalidArgument([&] { ValidateFields("Stall", stall); });
  };
  EXPECT_NO_THROW(ValidateFields("Stall", Stall()));
  EXPECT_EQ(error([](Stall* s) { s->place(1) = std::nan(""); }),
            "Stall: field `place` expected finite values, got [1, nan]");
  EXPECT_EQ(error([](Stall* s) { s->price = 0; }),
            "Stall: field `price` expected a finite value > 0, got 0");
  EXPECT_EQ(error([](Stall* s) { s->left = 10; }),
            "Stall: field `left` expected a number in [0, 9], got 10");
  EXPECT_EQ(error([](Stall* s) { s->basket.fruit = static_cast<Fruit>(7); }),
            "Basket: field `fruit` expected one of \"apple\", \"pear\", got 7");
  EXPECT_EQ(error([](Stall* s) { s->till = {{1}, {-1}}; }),
            "Coin: field `value` expected a finite value > 0, got -1");
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
