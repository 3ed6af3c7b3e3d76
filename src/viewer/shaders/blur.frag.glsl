// Removes the 4 x 4 noise pattern of the occlusion pass with a depth-aware blur.
uniform sampler2D source;
uniform sampler2D normal_map;
in vec3 ray;
layout(location = 0) out vec4 result;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  ivec2 last = ivec2(viewport.xy) - 1;
  vec3 n = texelFetch(normal_map, pixel, 0).xyz;
  float sum = 0.0, weights = 1e-4;
  for (int y = -2; y < 2; ++y) {
    for (int x = -2; x < 2; ++x) {
      ivec2 other = clamp(pixel + ivec2(x, y), ivec2(0), last);
      float weight = max(dot(n, texelFetch(normal_map, other, 0).xyz), 0.0) + 1e-4;
      sum += weight * texelFetch(source, other, 0).r;
      weights += weight;
    }
  }
  result = vec4(sum / weights);
}
