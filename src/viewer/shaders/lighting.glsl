// Sun with soft shadows, sky, fog.
uniform sampler2D shadow_map;
uniform sampler2D occlusion_map;

const vec3 kSun = vec3(1.00, 0.91, 0.77) * 2.7;
const vec3 kZenith = vec3(0.10, 0.25, 0.56);
const vec3 kHorizon = vec3(0.60, 0.71, 0.82);
const vec3 kSkyLight = vec3(0.46, 0.51, 0.58);
const vec3 kBounce = vec3(0.24, 0.22, 0.20);

vec3 sky(vec3 direction) {
  float up = clamp(direction.y, 0.0, 1.0);
  vec3 colour = mix(kHorizon, kZenith, pow(up, 0.45));
  float towards = max(dot(direction, sun.xyz), 0.0);
  return colour + kSun * (0.10 * pow(towards, 24.0) + 0.03 * pow(towards, 5.0));
}

// Interleaved gradient noise (Jimenez 2014): turns sampling bands into fine grain.
float noise_of_pixel() {
  return fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
}

// Percentage-closer soft shadows (Fernando 2005): the blur grows with the distance to the blocker,
// so that contact shadows are sharp.
float sunlight(vec3 p, vec3 n, float most_taps) {
  if (shadow.w < 1.0) return 1.0;
  float facing = max(dot(n, sun.xyz), 0.05);
  vec3 at = (light * vec4(p + n * shadow.x * 1.5, 1.0)).xyz;
  if (any(lessThan(at.xy, vec2(0.001))) || any(greaterThan(at.xy, vec2(0.999)))) return 1.0;
  // Depth gradient of a surface with this normal in the map, which prevents self-shadowing.
  vec3 n_light = vec3(light[0][0] * n.x + light[1][0] * n.y + light[2][0] * n.z,
                      light[0][1] * n.x + light[1][1] * n.y + light[2][1] * n.z, 0.0) * shadow.y;
  vec2 slope = clamp(n_light.xy / facing, -6.0, 6.0) * (shadow.y / shadow.z);
  float bias = 1.2 * shadow.x / shadow.z;
  float turn = 6.2831853 * noise_of_pixel();
  int count = int(min(shadow.w, most_taps));
  mat2 on_disk = inversesqrt(float(count)) * mat2(cos(turn), sin(turn), -sin(turn), cos(turn));
  float search = clamp(0.5 * sun.w * at.z * shadow.z, shadow.x * 2.0, shadow.x * 60.0) / shadow.y;
  float blocker = 0.0, blockers = 0.0;
  for (int i = 0; i < count; ++i) {
    vec2 offset = on_disk * (taps[i].xy * (taps[i].z * search));
    float depth = texture(shadow_map, at.xy + offset).r;
    if (depth < min(at.z + dot(slope, offset) - bias, 0.99999)) {
      blocker += depth;
      blockers += 1.0;
    }
  }
  if (blockers < 0.5) return 1.0;
  // Shadows fade towards the border of the map, where they would otherwise be cut off.
  vec2 border = min(at.xy, 1.0 - at.xy);
  float beyond = 1.0 - smoothstep(0.0, 0.1, min(border.x, border.y));
  if (blockers > float(count) - 0.5) return beyond;
  float gap = (at.z - blocker / blockers) * shadow.z;
  float blur = clamp(gap * sun.w, shadow.x * 1.2, shadow.x * 60.0) / shadow.y;
  float lit = 0.0;
  for (int i = 0; i < count; ++i) {
    vec2 offset = on_disk * (taps[i].xy * (taps[i].z * blur));
    float depth = texture(shadow_map, at.xy + offset).r;
    lit += depth < min(at.z + dot(slope, offset) - bias, 0.99999) ? 0.0 : 1.0;
  }
  return mix(lit / float(count), 1.0, beyond);
}

float ambient_light() {
  if (occlusion.y < 1.0) return 1.0;
  return texelFetch(occlusion_map, ivec2(gl_FragCoord.xy), 0).r;
}

vec3 fogged(vec3 colour, vec3 p) {
  float far_away = length(p) / occlusion.z;
  vec3 direction = normalize(p);
  vec3 haze = sky(normalize(vec3(direction.x, max(direction.y, 0.0), direction.z)));
  return mix(haze, colour, exp(-far_away * far_away));
}

// A surface of the given colour; gloss 1 is a clear coat that reflects the sky. The normal of the face
// differs from the smooth normal `n` on triangles.
vec3 shaded_face(vec3 albedo, vec3 n, vec3 face, vec3 p, float gloss, float most_taps) {
  vec3 to_eye = -normalize(p);
  float open = ambient_light();
  float facing = dot(n, sun.xyz);
  float lit = min(facing, dot(face, sun.xyz)) > 0.0 ? sunlight(p, face, most_taps) : 0.0;
  vec3 ambient = mix(kBounce, kSkyLight, 0.5 + 0.5 * n.y) * open;
  vec3 colour = albedo * (ambient + kSun * max(facing, 0.0) * lit);
  float grazing = 1.0 - max(dot(n, to_eye), 0.0);
  float fresnel = gloss * (0.04 + 0.96 * pow(grazing, 5.0));
  vec3 mirrored = reflect(-to_eye, n);
  vec3 around = mirrored.y > 0.0 ? sky(mirrored) : mix(kHorizon, kBounce, min(1.0, -4.0 * mirrored.y));
  colour = mix(colour, around * open * open, fresnel);
  float glint = max(dot(n, normalize(sun.xyz + to_eye)), 0.0);
  colour += kSun * gloss * lit * (1.6 * pow(glint, 420.0) + 0.10 * pow(glint, 40.0));
  return fogged(colour, p);
}

vec3 shaded(vec3 albedo, vec3 n, vec3 p, float gloss, float most_taps) {
  return shaded_face(albedo, n, n, p, gloss, most_taps);
}
