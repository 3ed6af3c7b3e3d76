/// A user of the window, who reads its panel and clicks what is there.
#pragma once

#include "src/viewer/interactive.hpp"
#include "src/viewer/widgets.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Knows of the panel what it says and where its widgets are drawn; all else goes through SDL's
/// events.
class User {
 public:
  /// @param density pixels of a unit of the window; the options' size is in units
  /// @throws as view::App
  explicit User(view::ViewOptions options, double density = 1);
  ~User();
  User(const User&) = delete;
  User& operator=(const User&) = delete;

  view::Show& show() { return app_.show(); }
  view::Window& window() { return app_.window(); }

  int finish() { return app_.finish(); }  ///< as view::App

  /// One picture, `seconds` after the last. @return false if it was the last one
  bool frame(double seconds = 0);
  const view::PanelLog& panel() const { return log_; }
  bool sees(const std::string& label) const { return log_.widgets.contains(label); }
  /// What a widget shows, or "" if there is no such widget.
  std::string value(const std::string& label) const;
  /// Whether some text of the panel has that in it.
  bool reads(std::string_view part) const;
  const std::vector<std::string>& texts() const { return log_.texts; }

  // Of a widget that is not there: std::runtime_error.
  void click(const std::string& label) { drag_in(label, 0.5, 0.5); }
  /// Presses at one share of the widget's width, from the left, and lets go at another.
  void drag_in(const std::string& label, double from, double to);
  /// Opens a list and clicks one of its entries, which may have to be scrolled to.
  void choose(const std::string& list, const std::string& entry);
  /// Replaces the text of a field.
  void type(const std::string& field, const std::string& text);
  // In the window's units:
  void click_at(Real x, Real y);
  void drag(Real from_x, Real from_y, Real to_x, Real to_y);

 private:
  const view::PanelLog::Widget& find(const std::string& label) const;
  void move_to(float x, float y);
  void press(bool down);

  /// Makes the screen as dense as that, and the size one in pixels.
  static view::ViewOptions on_screen(view::ViewOptions options, double density);

  view::PanelLog log_;
  view::App app_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
