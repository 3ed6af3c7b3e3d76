/// Text and panels over the picture.
#include "src/viewer/ui.hpp"

#include <algorithm>
#include <imgui.h>
#if __has_include(<backends/imgui_impl_sdl2.h>)
#include <backends/imgui_impl_sdl2.h>
#else
#include <backends/imgui_impl_sdl.h>
#endif
#include <backends/imgui_impl_opengl3.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr float kTextSize = 13;  // of the default font [units]

}  // namespace

Ui::Ui(Window& window) : window_(&window), width_(window.width()), height_(window.height()) {
  set_up();
  ImGui_ImplSDL2_InitForOpenGL(window.sdl(), window.context());
}

Ui::Ui(const OffscreenFramebuffer& offscreen)
    : width_(offscreen.width()), height_(offscreen.height()) {
  set_up();
}

void Ui::set_up() {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // writes no settings file
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 7;
  style.FrameRounding = 4;
  style.GrabRounding = 4;
  style.WindowBorderSize = 0;
  style.FramePadding = {7, 4};
  style.ItemSpacing = {8, 5};
  style.Colors[ImGuiCol_WindowBg] = {0.06f, 0.08f, 0.11f, 0.86f};
  style.Colors[ImGuiCol_TitleBgActive] = {0.10f, 0.22f, 0.40f, 1.0f};
  style.Colors[ImGuiCol_PlotLines] = {0.55f, 0.78f, 1.0f, 1.0f};
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

Ui::~Ui() {
  ImGui_ImplOpenGL3_Shutdown();
  if (window_ != nullptr) ImGui_ImplSDL2_Shutdown();
  ImGui::DestroyContext();
}

void Ui::handle(const SDL_Event& event) { ImGui_ImplSDL2_ProcessEvent(&event); }
bool Ui::wants_keyboard() const { return ImGui::GetIO().WantTextInput; }
bool Ui::wants_mouse() const { return ImGui::GetIO().WantCaptureMouse; }

/// Renders the font at the resolution of the screen with a constant size in units. The resolution
/// changes when the window is moved to another screen.
void Ui::fit_text(float pixel_ratio) {
  if (pixel_ratio == pixel_ratio_) return;
  pixel_ratio_ = pixel_ratio;
  ImGuiIO& io = ImGui::GetIO();
  ImFontConfig font;
  font.SizePixels = kTextSize * pixel_ratio;
  io.Fonts->Clear();
  const ImFont* const text = io.Fonts->AddFontDefault(&font);
  io.Fonts->Build();  // some versions of Dear ImGui round the size
  io.FontGlobalScale = kTextSize / text->FontSize;
  ImGui_ImplOpenGL3_DestroyDeviceObjects();  // the next frame recreates them
}

void Ui::begin(double seconds) {
  const bool seen = window_ != nullptr && !window_->minimised();
  if (seen) {
    width_ = window_->width();
    height_ = window_->height();
    fit_text(window_->pixel_ratio());
  } else if (window_ == nullptr) {
    fit_text(1);
  }
  ImGui_ImplOpenGL3_NewFrame();
  if (window_ != nullptr) {
    ImGui_ImplSDL2_NewFrame();
  } else {
    ImGui::GetIO().DeltaTime = std::max(static_cast<float>(seconds), 1e-4f);
  }
  if (!seen) {  // a minimised window has no size
    ImGui::GetIO().DisplaySize = {static_cast<float>(width_), static_cast<float>(height_)};
  }
  ImGui::NewFrame();
}

void Ui::end(GLuint framebuffer, int width, int height) {
  ImGui::Render();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, width, height);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
