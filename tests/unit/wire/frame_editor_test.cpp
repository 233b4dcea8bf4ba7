// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "tests/unit/wire/descriptions.hpp"

namespace prism::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Frame {
  std::int32_t kind;
  Bytes bytes;
};

FrameDescriptionPtr with_all_axes(const std::string& name) {
  GyroChoice all;
  all.axes.clear();
  const FrameDescriptionPtr first = test::shipped(name);
  for (const std::string& axis : first->axis_names) all.axes.push_back({.axis = axis});
  return test::shipped(name, all);
}

/// The gyro's frames among the test vectors, and in all recorded and printed frames that this checkout has.
std::vector<Frame> frames_of(const FrameDescriptionPtr& description) {
  std::vector<Frame> frames;
  for (const TestVector& vector : description->test_vectors) {
    for (std::size_t k = 0; k < description->kinds.size(); ++k) {
      if (description->kinds[k].name == vector.kind) frames.push_back({static_cast<std::int32_t>(k), vector.bytes});
    }
  }
  for (const auto& folder :
       {std::filesystem::path(PRISM_SOURCE_DIR) / "tests/unit/wire/data", test::shared_dir() / "frames"}) {
    if (!std::filesystem::exists(folder)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (!entry.is_regular_file() || entry.path().extension() == ".hex") continue;
      const std::string text = test::read_file(entry.path());
      const Bytes bytes(text.begin(), text.end());
      for (const DecodedMessage& found : test::decode(description, bytes)) {
        const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(found.offset);
        frames.push_back({found.kind, Bytes(at, at + found.length)});
      }
    }
  }
  FrameEncoder encoder(description);
  for (std::size_t k = 0; k < description->sent_kinds.size(); ++k) {
    Frame& made = frames.emplace_back(Frame{description->sent_kinds[k], {}});
    encoder.encode(
        {.rate_deg_per_h = {7200.5, -99.25, 3}, .interval_s = description->period_s(), .temperature_degc = 21.5},
        made.bytes);
    made.bytes.resize(made.bytes.size() - description->kinds[static_cast<std::size_t>(made.kind)].trailer.size());
  }
  std::erase_if(frames, [&](const Frame& frame) {
    return !description->kinds[static_cast<std::size_t>(frame.kind)].roles.carries_gyro();
  });
  return frames;
}

/// Writes the numbers of the axes of `source`, moved by `change` units of their fields towards 0, into `frame`; returns
/// the number of axes.
int edit(const FrameDescription& description, FrameEditor& editor, const Frame& frame, const Bytes& source,
         double change) {
  const MessageType& kind = description.kinds[static_cast<std::size_t>(frame.kind)];
  FrameView view;
  view.look_at(kind, source);
  editor.begin(frame.kind, frame.bytes);
  int edited = 0;
  for (std::size_t axis = 0; axis < kind.roles.axes.size(); ++axis) {
    const auto& fields = kind.roles.axes[axis].gyro;
    const auto known = std::ranges::find_if(fields, [&](int field) { return !std::isnan(view.value(field)); });
    if (known == fields.end()) continue;
    const Field& field = kind.fields[static_cast<std::size_t>(*known)];
    const double value = view.value(*known), wanted = value - std::copysign(change * field.scaling.scale, value);
    const double found = editor.put(axis, wanted), wrap = description.axes[axis].wrap;
    EXPECT_NEAR(wrap == 0 ? found - wanted : std::remainder(found - wanted, wrap), 0,
                0.501 * std::abs(field.scaling.scale) + 1e-6 * std::abs(wanted))
        << field.name;
    ++edited;
  }
  return edited;
}

class Editor : public testing::TestWithParam<std::string> {};

TEST_P(Editor, ChangesOnlyRatesAndChecks) {
  const auto description = with_all_axes(GetParam());
  FrameEditor editor(description);
  int edited = 0;
  for (const Frame& frame : frames_of(description)) {
    edit(*description, editor, frame, frame.bytes, 0);
    const auto same = editor.finish();
    ASSERT_TRUE(std::ranges::equal(same, frame.bytes));
    edited += edit(*description, editor, frame, frame.bytes, 3);
    const auto changed = editor.finish();
    const Bytes moved(changed.begin(), changed.end());
    // With the first numbers again it is the same frame: nothing but the rates and the checks was changed.
    edit(*description, editor, {frame.kind, moved}, frame.bytes, 0);
    EXPECT_TRUE(std::ranges::equal(editor.finish(), frame.bytes));
    FrameView view;
    const MessageType& kind = description->kinds[static_cast<std::size_t>(frame.kind)];
    EXPECT_EQ(match_frame(kind, moved, -1, view).match == Match::kYes,
              match_frame(kind, frame.bytes, -1, view).match == Match::kYes);
  }
  EXPECT_GT(edited, 0);
}

INSTANTIATE_TEST_SUITE_P(Descriptions, Editor, testing::ValuesIn(test::shipped_gyros()), [](const auto& one) {
  std::string name = one.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST(FrameEditor, PrintsNumbersAsTheDeviceDoes) {
  struct Case {
    const char* found;
    double number;
    const char* printed;
  };
  for (const Case& one : {Case{"0.015733", -0.0157331, "-0.015733"},
                          {"+000.1234", -12.34567, "-012.3457"},
                          {"-00012", 7, "000007"},
                          {"12", 3.6, "4"},
                          {"+7", -0.5, "+0"},
                          {"-0.10", -0.001, "0.00"}}) {
    EXPECT_EQ(print_like(one.found, one.number, '.'), one.printed) << one.found;
  }
  EXPECT_EQ(print_like("+1,50", 2.25, ','), "+2,25");
}

TEST(FrameEditor, RefusesWhatTheFieldCannotHave) {
  const auto description = test::shipped("fizoptika");  // 24 bits
  FrameEditor editor(description);
  const Frame frame = frames_of(description).front();
  editor.begin(frame.kind, frame.bytes);
  EXPECT_TRUE(std::isnan(editor.put(0, 1e7)));
  EXPECT_TRUE(std::ranges::equal(editor.finish(), frame.bytes)) << "unchanged";
  EXPECT_FALSE(editor.mark()) << "no bit is described";
}

TEST(FrameEditor, MarksACorrectedFrame) {
  std::string text = test::read_file(test::frames_dir() / "trplg.json");
  text.replace(text.find("\"meaning\""), 0, "\"corrected\": {\"field\": \"status\", \"mask\": \"0x40\"}, ");
  const auto description = test::description_of(text);
  EXPECT_EQ(description->id, test::shipped("trplg")->id) << "the bit does not change what is decoded";
  FrameEditor editor(description);
  const Frame frame = frames_of(description).front();
  editor.begin(frame.kind, frame.bytes);
  ASSERT_TRUE(editor.mark());
  const auto marked = editor.finish();
  FrameView view;
  const MessageType& kind = description->kinds[static_cast<std::size_t>(frame.kind)];
  ASSERT_EQ(match_frame(kind, marked, -1, view).match, Match::kYes);
  EXPECT_EQ(view.bits(kind.field_index("status")) & 0x40, 0x40u);
}

}  // namespace
}  // namespace prism::wire
