// Tone mapping: averages the tone-mapped samples of each pixel and converts to sRGB.
uniform sampler2D source;
uniform int scale;  // samples per pixel along each axis
uniform ivec2 origin;
in vec3 ray;
layout(location = 0) out vec4 result;

// Fit of the ACES curve by Narkowicz (2015).
vec3 tone(vec3 x) {
  x *= 0.72;
  return clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
}

void main() {
  ivec2 first = (ivec2(gl_FragCoord.xy) - origin) * scale;
  vec3 sum = vec3(0.0);
  for (int y = 0; y < scale; ++y) {
    for (int x = 0; x < scale; ++x) sum += tone(texelFetch(source, first + ivec2(x, y), 0).rgb);
  }
  vec3 c = sum / float(scale * scale);
  c = mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
  result = vec4(c, 1.0);
}
