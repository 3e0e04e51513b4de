<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="categorizedSymbol" attr="kind" forceraster="0" enableorderby="0" symbollevels="0">
    <categories>
      <category symbol="0" value="joint" label="Joint" render="true"/>
      <category symbol="1" value="dark" label="Dry dark area" render="true"/>
      <category symbol="2" value="leak" label="Leak" render="true"/>
    </categories>
    <symbols>
      <symbol name="0" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="63,174,63,40"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="63,174,63,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.4"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="107,107,107,40"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="107,107,107,255"/>
            <Option type="QString" name="outline_style" value="dash"/>
            <Option type="QString" name="outline_width" value="0.4"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="2" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="230,126,0,45"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="230,126,0,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.4"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="&quot;kind&quot; || coalesce(': ' || array_to_string(&quot;reasons&quot;, ', '), '') || '\n' || format_number(&quot;area&quot;, 2) || ' m²' || if(&quot;kind&quot; = &quot;kind_detected&quot;, coalesce(', ' || round(100 * &quot;confidence&quot;) || ' %', ''), '')" isExpression="1" fontFamily="Sans Serif" namedStyle="Regular" fontWeight="50" fontSize="8" fontSizeUnit="Point" textColor="30,30,30,255" textOpacity="1" multilineHeight="1" allowHtml="0">
        <text-buffer bufferDraw="0" bufferSize="0.7" bufferSizeUnits="MM" bufferColor="255,255,255,215" bufferOpacity="1" bufferJoinStyle="128" bufferNoFill="1"/>
        <background shapeDraw="1" shapeType="0" shapeSizeType="0" shapeSizeX="0.8" shapeSizeY="0.5" shapeSizeUnit="MM" shapeRadiiX="0.8" shapeRadiiY="0.8" shapeRadiiUnit="MM" shapeFillColor="255,255,255,225" shapeBorderColor="150,150,150,255" shapeBorderWidth="0.1" shapeBorderWidthUnit="MM" shapeOpacity="1" shapeJoinStyle="128"/>
        <shadow shadowDraw="0"/>
      </text-style>
      <text-format multilineAlign="1"/>
      <placement placement="8" dist="1.5" distUnits="MM" polygonPlacementFlags="3" priority="8"/>
      <rendering scaleVisibility="1" scaleMin="0" scaleMax="4000" obstacle="1" obstacleFactor="1" displayAll="0" drawLabels="1" upsidedownLabels="0" fontLimitPixelSize="0" mergeLines="0" limitNumLabels="0" minFeatureSize="0"/>
      <dd_properties>
        <Option type="Map">
          <Option type="QString" name="name" value=""/>
          <Option type="Map" name="properties">
            <Option type="Map" name="Color">
              <Option type="bool" name="active" value="true"/>
              <Option type="QString" name="expression" value="CASE WHEN &quot;kind&quot; = 'leak' THEN '#a34d00' WHEN &quot;kind&quot; = 'joint' THEN '#00695f' ELSE '#6d1b7b' END"/>
              <Option type="int" name="type" value="3"/>
            </Option>
          </Option>
          <Option type="QString" name="type" value="collection"/>
        </Option>
      </dd_properties>
    </settings>
  </labeling>
  <fieldConfiguration>
    <field name="id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="km" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="segment" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage_from" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="3"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="chainage_to" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="3"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="label" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="arc_from" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="2"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="arc_to" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="2"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="clock" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="1"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="kind" configurationFlags="None">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option type="List" name="map">
              <Option type="Map">
                <Option type="QString" name="Leak" value="leak"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="Joint" value="joint"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="Dry dark area" value="dark"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="kind_label" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="kind_detected" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="wet" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="origin" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="manual" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="severity" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="severity_label" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="width_mm" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="length" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="orientation" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="orientation_class" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="area" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="2"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="measured" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="darkening_mean" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="1"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="darkening_max" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="1"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="image_share" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="2"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="contrast" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="1"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="confidence" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="2"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="reasons" configurationFlags="None">
      <editWidget type="List">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="review" configurationFlags="None">
      <editWidget type="ValueMap">
        <config>
          <Option type="Map">
            <Option type="List" name="map">
              <Option type="Map">
                <Option type="QString" name="Open" value="open"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="Confirmed" value="confirmed"/>
              </Option>
              <Option type="Map">
                <Option type="QString" name="Rejected" value="rejected"/>
              </Option>
            </Option>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="reviewed_by" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="reviewed_at" configurationFlags="None">
      <editWidget type="DateTime">
        <config>
          <Option type="Map">
            <Option type="bool" name="allow_null" value="true"/>
            <Option type="bool" name="calendar_popup" value="true"/>
            <Option type="QString" name="display_format" value="yyyy-MM-dd HH:mm"/>
            <Option type="bool" name="field_iso_format" value="false"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="remark" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" name="IsMultiline" value="false"/>
            <Option type="bool" name="UseHtml" value="false"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="drawn_by" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="drawn_at" configurationFlags="None">
      <editWidget type="DateTime">
        <config>
          <Option type="Map">
            <Option type="bool" name="allow_null" value="true"/>
            <Option type="bool" name="calendar_popup" value="true"/>
            <Option type="QString" name="display_format" value="yyyy-MM-dd HH:mm"/>
            <Option type="bool" name="field_iso_format" value="false"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="detected" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="created_at" configurationFlags="None">
      <editWidget type="DateTime">
        <config>
          <Option type="Map">
            <Option type="bool" name="allow_null" value="true"/>
            <Option type="bool" name="calendar_popup" value="true"/>
            <Option type="QString" name="display_format" value="yyyy-MM-dd HH:mm"/>
            <Option type="bool" name="field_iso_format" value="false"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="detected_at" configurationFlags="None">
      <editWidget type="DateTime">
        <config>
          <Option type="Map">
            <Option type="bool" name="allow_null" value="true"/>
            <Option type="bool" name="calendar_popup" value="true"/>
            <Option type="QString" name="display_format" value="yyyy-MM-dd HH:mm"/>
            <Option type="bool" name="field_iso_format" value="false"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="also_detected" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="detected_as" configurationFlags="None">
      <editWidget type="List">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="parent_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="merged_into" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="merged" configurationFlags="None">
      <editWidget type="List">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="same_as" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="dry_region_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="counted" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="state" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="photos" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="evidence" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="model" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="superseded" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="other_images" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="other_contrast" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="easting" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="2"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="northing" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="2"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="height" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" name="AllowNull" value="true"/>
            <Option type="int" name="Precision" value="2"/>
            <Option type="QString" name="Style" value="SpinBox"/>
          </Option>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <expressionfields>
    <field name="clock_text" expression="with_variable('minutes', round(&quot;clock&quot; * 60) % 720, to_string(if(@minutes &lt; 60, 12, floor(@minutes / 60))) || ':' || lpad(to_string(@minutes % 60), 2, '0'))" type="10" typeName="string" subType="0" length="0" precision="0" comment=""/>
  </expressionfields>
  <aliases>
    <alias index="0" field="id" name="Anomaly"/>
    <alias index="1" field="survey_id" name="Survey key"/>
    <alias index="2" field="survey" name="Survey"/>
    <alias index="3" field="km" name="Kilometre"/>
    <alias index="4" field="segment" name="Segment"/>
    <alias index="5" field="chainage_from" name="Chainage from (m)"/>
    <alias index="6" field="chainage_to" name="Chainage to (m)"/>
    <alias index="7" field="label" name="Chainage"/>
    <alias index="8" field="arc_from" name="Arc from (m)"/>
    <alias index="9" field="arc_to" name="Arc to (m)"/>
    <alias index="10" field="clock" name="Clock position (h)"/>
    <alias index="11" field="kind" name="Kind"/>
    <alias index="12" field="kind_label" name="Kind (name)"/>
    <alias index="13" field="kind_detected" name="Found as"/>
    <alias index="14" field="wet" name="Wet"/>
    <alias index="15" field="origin" name="Origin of the outline"/>
    <alias index="16" field="manual" name="Drawn by hand"/>
    <alias index="17" field="severity" name="Severity"/>
    <alias index="18" field="severity_label" name="Severity (name)"/>
    <alias index="19" field="width_mm" name="Width of the line (mm)"/>
    <alias index="20" field="length" name="Length (m)"/>
    <alias index="21" field="orientation" name="Angle to the axis (°)"/>
    <alias index="22" field="orientation_class" name="Direction"/>
    <alias index="23" field="area" name="Area (m²)"/>
    <alias index="24" field="measured" name="Measured on the image"/>
    <alias index="25" field="darkening_mean" name="Mean darkening (dB)"/>
    <alias index="26" field="darkening_max" name="Greatest darkening (dB)"/>
    <alias index="27" field="image_share" name="Share measured"/>
    <alias index="28" field="contrast" name="Contrast (sigma)"/>
    <alias index="29" field="confidence" name="Confidence (0-1)"/>
    <alias index="30" field="reasons" name="Reasons"/>
    <alias index="31" field="review" name="Review"/>
    <alias index="32" field="reviewed_by" name="Reviewed by"/>
    <alias index="33" field="reviewed_at" name="Reviewed at"/>
    <alias index="34" field="remark" name="Remark"/>
    <alias index="35" field="drawn_by" name="Drawn by"/>
    <alias index="36" field="drawn_at" name="Drawn at"/>
    <alias index="37" field="detected" name="Found by the last detection"/>
    <alias index="38" field="created_at" name="First detected"/>
    <alias index="39" field="detected_at" name="Last detected"/>
    <alias index="40" field="also_detected" name="Also detected"/>
    <alias index="41" field="detected_as" name="Detected as"/>
    <alias index="42" field="parent_id" name="Split off"/>
    <alias index="43" field="merged_into" name="Merged into"/>
    <alias index="44" field="merged" name="Merged into this"/>
    <alias index="45" field="same_as" name="Same as"/>
    <alias index="46" field="dry_region_id" name="In dry region"/>
    <alias index="47" field="counted" name="Included in totals"/>
    <alias index="48" field="state" name="State"/>
    <alias index="49" field="photos" name="Photos"/>
    <alias index="50" field="evidence" name="Evidence for and against a leak"/>
    <alias index="51" field="model" name="Classified by model"/>
    <alias index="52" field="superseded" name="Superseded"/>
    <alias index="53" field="other_images" name="In other images"/>
    <alias index="54" field="other_contrast" name="Contrast there (sigma)"/>
    <alias index="55" field="clock_text" name="Clock position"/>
    <alias index="56" field="easting" name="Easting (m)"/>
    <alias index="57" field="northing" name="Northing (m)"/>
    <alias index="58" field="height" name="Height (m)"/>
  </aliases>
  <editable>
    <field name="id" editable="0"/>
    <field name="survey_id" editable="0"/>
    <field name="survey" editable="0"/>
    <field name="km" editable="0"/>
    <field name="segment" editable="0"/>
    <field name="chainage_from" editable="0"/>
    <field name="chainage_to" editable="0"/>
    <field name="label" editable="0"/>
    <field name="arc_from" editable="0"/>
    <field name="arc_to" editable="0"/>
    <field name="clock" editable="0"/>
    <field name="kind" editable="1"/>
    <field name="kind_label" editable="0"/>
    <field name="kind_detected" editable="0"/>
    <field name="wet" editable="0"/>
    <field name="origin" editable="0"/>
    <field name="manual" editable="0"/>
    <field name="severity" editable="0"/>
    <field name="severity_label" editable="0"/>
    <field name="width_mm" editable="0"/>
    <field name="length" editable="0"/>
    <field name="orientation" editable="0"/>
    <field name="orientation_class" editable="0"/>
    <field name="area" editable="0"/>
    <field name="measured" editable="0"/>
    <field name="darkening_mean" editable="0"/>
    <field name="darkening_max" editable="0"/>
    <field name="image_share" editable="0"/>
    <field name="contrast" editable="0"/>
    <field name="confidence" editable="0"/>
    <field name="reasons" editable="0"/>
    <field name="review" editable="1"/>
    <field name="reviewed_by" editable="0"/>
    <field name="reviewed_at" editable="0"/>
    <field name="remark" editable="1"/>
    <field name="drawn_by" editable="0"/>
    <field name="drawn_at" editable="0"/>
    <field name="detected" editable="0"/>
    <field name="created_at" editable="0"/>
    <field name="detected_at" editable="0"/>
    <field name="also_detected" editable="0"/>
    <field name="detected_as" editable="0"/>
    <field name="parent_id" editable="0"/>
    <field name="merged_into" editable="0"/>
    <field name="merged" editable="0"/>
    <field name="same_as" editable="0"/>
    <field name="dry_region_id" editable="0"/>
    <field name="counted" editable="0"/>
    <field name="state" editable="0"/>
    <field name="photos" editable="0"/>
    <field name="evidence" editable="0"/>
    <field name="model" editable="0"/>
    <field name="superseded" editable="0"/>
    <field name="other_images" editable="0"/>
    <field name="other_contrast" editable="0"/>
    <field name="easting" editable="0"/>
    <field name="northing" editable="0"/>
    <field name="height" editable="0"/>
  </editable>
  <editorlayout>tablayout</editorlayout>
  <attributeEditorForm>
    <attributeEditorContainer name="Review" columnCount="1" groupBox="1" showLabel="1" visibilityExpressionEnabled="0" visibilityExpression="">
      <attributeEditorField name="review" index="31" showLabel="1"/>
      <attributeEditorField name="kind" index="11" showLabel="1"/>
      <attributeEditorField name="remark" index="34" showLabel="1"/>
      <attributeEditorField name="reviewed_by" index="32" showLabel="1"/>
      <attributeEditorField name="reviewed_at" index="33" showLabel="1"/>
    </attributeEditorContainer>
    <attributeEditorContainer name="Finding" columnCount="2" groupBox="1" showLabel="1" visibilityExpressionEnabled="0" visibilityExpression="">
      <attributeEditorField name="id" index="0" showLabel="1"/>
      <attributeEditorField name="label" index="7" showLabel="1"/>
      <attributeEditorField name="segment" index="4" showLabel="1"/>
      <attributeEditorField name="clock_text" index="55" showLabel="1"/>
      <attributeEditorField name="area" index="23" showLabel="1"/>
      <attributeEditorField name="image_share" index="27" showLabel="1"/>
      <attributeEditorField name="kind_detected" index="13" showLabel="1"/>
      <attributeEditorField name="confidence" index="29" showLabel="1"/>
      <attributeEditorField name="other_images" index="53" showLabel="1"/>
      <attributeEditorField name="other_contrast" index="54" showLabel="1"/>
      <attributeEditorField name="reasons" index="30" showLabel="1"/>
      <attributeEditorField name="evidence" index="50" showLabel="1"/>
      <attributeEditorField name="contrast" index="28" showLabel="1"/>
      <attributeEditorField name="darkening_mean" index="25" showLabel="1"/>
      <attributeEditorField name="darkening_max" index="26" showLabel="1"/>
      <attributeEditorField name="chainage_from" index="5" showLabel="1"/>
      <attributeEditorField name="chainage_to" index="6" showLabel="1"/>
      <attributeEditorField name="arc_from" index="8" showLabel="1"/>
      <attributeEditorField name="arc_to" index="9" showLabel="1"/>
      <attributeEditorField name="detected" index="37" showLabel="1"/>
      <attributeEditorField name="created_at" index="38" showLabel="1"/>
      <attributeEditorField name="detected_at" index="39" showLabel="1"/>
      <attributeEditorField name="counted" index="47" showLabel="1"/>
      <attributeEditorField name="model" index="51" showLabel="1"/>
      <attributeEditorField name="origin" index="15" showLabel="1"/>
      <attributeEditorField name="survey" index="2" showLabel="1"/>
    </attributeEditorContainer>
  </attributeEditorForm>
  <previewExpression>"label"</previewExpression>
  <mapTip>&lt;b&gt;[% replace("label", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;/b&gt;, [% format_number("area", 2) %] m², [% with_variable('minutes', round("clock" * 60) % 720, to_string(if(@minutes &lt; 60, 12, floor(@minutes / 60))) || ':' || lpad(to_string(@minutes % 60), 2, '0')) %] o'clock&lt;br&gt;[% replace("kind", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %], confidence [% coalesce(round(100 * "confidence") || ' %', 'unknown') %] as [% replace("kind_detected", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;br&gt;darkening [% format_number("darkening_mean", 1) %] dB, [% replace("review", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
