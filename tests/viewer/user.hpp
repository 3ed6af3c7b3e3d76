/// Simulated user of the window, for tests of the panel.
#pragma once

#include "src/viewer/interactive.hpp"
#include "src/viewer/widgets.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

/// Reads the log of the panel and operates its widgets by SDL events at their positions.
class User {
 public:
  /// @param density pixels per unit of the window; the size in the options is in units. Few pixels
  ///     by default, because a driver without a GPU takes most of a test's time for them.
  /// @throws as view::App
  explicit User(view::ViewOptions options, double density = 0.25);
  ~User();
  User(const User&) = delete;
  User& operator=(const User&) = delete;

  view::Viewer& viewer() { return app_.viewer(); }
  view::Window& window() { return app_.window(); }

  int finish() { return app_.finish(); }  ///< as view::App

  /// Draws one picture, `seconds` after the previous one. @return false if it was the last one
  bool frame(double seconds = 0);
  const view::PanelLog& panel() const { return log_; }
  bool sees(const std::string& label) const { return log_.widgets.contains(label); }
  /// The displayed value of a widget, or "" if there is no such widget.
  std::string value(const std::string& label) const;
  /// True if a text of the panel contains `part`.
  bool reads(std::string_view part) const;
  const std::vector<std::string>& texts() const { return log_.texts; }

  // These throw std::runtime_error if the widget does not exist.
  void click(const std::string& label) { drag_in(label, 0.5, 0.5); }
  /// Drags the mouse between two positions in the widget, as fractions of its width from the left.
  void drag_in(const std::string& label, double from, double to);
  /// Opens a list, scrolls to one of its entries and clicks it.
  void choose(const std::string& list, const std::string& entry);
  /// Replaces the text of a field.
  void type(const std::string& field, const std::string& text);
  // In units of the window:
  void click_at(Real x, Real y);
  void drag(Real from_x, Real from_y, Real to_x, Real to_y);

 private:
  const view::PanelLog::Widget& find(const std::string& label) const;
  void move_to(float x, float y);
  void press(bool down);

  /// Sets the density of the screen and converts the size to pixels.
  static view::ViewOptions on_screen(view::ViewOptions options, double density);

  view::PanelLog log_;
  view::App app_;
};

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
