/// Text and panels over the picture.
#include "examples/viewer/ui.hpp"

#include <algorithm>
#include <imgui.h>
#if __has_include(<backends/imgui_impl_sdl2.h>)
#include <backends/imgui_impl_sdl2.h>
#else
#include <backends/imgui_impl_sdl.h>
#endif
#include <backends/imgui_impl_opengl3.h>

namespace jfpx::inline JFPX_ABI::view {

Ui::Ui(Window& window) : on_window_(true) {
  set_up();
  ImGui_ImplSDL2_InitForOpenGL(window.sdl(), window.context());
  ImGui::GetIO().FontGlobalScale = std::max(1.0f, std::min(window.pixel_ratio(), 2.0f));
}

Ui::Ui(const Canvas& canvas) : on_window_(false), width_(canvas.width()), height_(canvas.height()) {
  set_up();
}

void Ui::set_up() {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // leaves no files behind
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
  if (on_window_) ImGui_ImplSDL2_Shutdown();
  ImGui::DestroyContext();
}

void Ui::handle(const SDL_Event& event) { ImGui_ImplSDL2_ProcessEvent(&event); }
bool Ui::wants_keyboard() const { return ImGui::GetIO().WantTextInput; }
bool Ui::wants_mouse() const { return ImGui::GetIO().WantCaptureMouse; }

void Ui::begin(double seconds) {
  ImGui_ImplOpenGL3_NewFrame();
  if (on_window_) {
    ImGui_ImplSDL2_NewFrame();
  } else {
    ImGui::GetIO().DisplaySize = {static_cast<float>(width_), static_cast<float>(height_)};
    ImGui::GetIO().DeltaTime = std::max(static_cast<float>(seconds), 1e-4f);
  }
  ImGui::NewFrame();
}

void Ui::end(GLuint framebuffer, int width, int height) {
  ImGui::Render();
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, width, height);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

}  // namespace jfpx::inline JFPX_ABI::view
