<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="RuleRenderer" forceraster="0" enableorderby="0" symbollevels="0">
    <rules key="rating">
      <rule key="rating0" symbol="0" label="Best result" filter="&quot;level&quot; = 1 AND &quot;complete&quot;"/>
      <rule key="rating1" symbol="1" label="At least: best result" filter="&quot;level&quot; = 1 AND NOT &quot;complete&quot;"/>
      <rule key="rating2" symbol="2" label="Up to a quarter of the scale" filter="&quot;level&quot; &gt; 1 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &gt; 0 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &lt;= 0.25 AND &quot;complete&quot;"/>
      <rule key="rating3" symbol="3" label="At least: up to a quarter of the scale" filter="&quot;level&quot; &gt; 1 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &gt; 0 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &lt;= 0.25 AND NOT &quot;complete&quot;"/>
      <rule key="rating4" symbol="4" label="Up to a half" filter="&quot;level&quot; &gt; 1 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &gt; 0.25 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &lt;= 0.5 AND &quot;complete&quot;"/>
      <rule key="rating5" symbol="5" label="At least: up to a half" filter="&quot;level&quot; &gt; 1 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &gt; 0.25 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &lt;= 0.5 AND NOT &quot;complete&quot;"/>
      <rule key="rating6" symbol="6" label="Up to three quarters" filter="&quot;level&quot; &gt; 1 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &gt; 0.5 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &lt;= 0.75 AND &quot;complete&quot;"/>
      <rule key="rating7" symbol="7" label="At least: up to three quarters" filter="&quot;level&quot; &gt; 1 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &gt; 0.5 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &lt;= 0.75 AND NOT &quot;complete&quot;"/>
      <rule key="rating8" symbol="8" label="Up to the worst result" filter="&quot;level&quot; &gt; 1 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &gt; 0.75 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &lt;= 1 AND &quot;complete&quot;"/>
      <rule key="rating9" symbol="9" label="At least: up to the worst result" filter="&quot;level&quot; &gt; 1 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &gt; 0.75 AND ((&quot;level&quot; - 1.0) / max(&quot;levels&quot; - 1, 1)) &lt;= 1 AND NOT &quot;complete&quot;"/>
      <rule key="rating10" symbol="10" label="Not rated" filter="&quot;level&quot; IS NULL"/>
    </rules>
    <symbols>
      <symbol name="0" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="47,125,66,90" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="214,208,178,60" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="214,208,178,255" name="color"/>
            <Option type="QString" value="b_diagonal" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="2" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="163,185,30,90" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="3" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="163,185,30,60" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="163,185,30,255" name="color"/>
            <Option type="QString" value="b_diagonal" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="4" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="240,196,25,90" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="5" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="240,196,25,60" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="240,196,25,255" name="color"/>
            <Option type="QString" value="b_diagonal" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="6" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="232,121,28,90" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="7" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="232,121,28,60" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="232,121,28,255" name="color"/>
            <Option type="QString" value="b_diagonal" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="8" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="179,23,29,90" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="9" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="179,23,29,60" name="color"/>
            <Option type="QString" value="solid" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="179,23,29,255" name="color"/>
            <Option type="QString" value="b_diagonal" name="style"/>
            <Option type="QString" value="70,70,70,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="10" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" value="150,150,150,70" name="color"/>
            <Option type="QString" value="dense6" name="style"/>
            <Option type="QString" value="90,90,90,255" name="outline_color"/>
            <Option type="QString" value="solid" name="outline_style"/>
            <Option type="QString" value="0.3" name="outline_width"/>
            <Option type="QString" value="MM" name="outline_width_unit"/>
            <Option type="QString" value="miter" name="joinstyle"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="&quot;name&quot; || '\n' || &quot;result_text&quot;" isExpression="1" fontFamily="Sans Serif" namedStyle="Bold" fontWeight="75" fontSize="8" fontSizeUnit="Point" textColor="30,30,30,255" textOpacity="1" multilineHeight="1" allowHtml="0">
        <text-buffer bufferDraw="1" bufferSize="0.8" bufferSizeUnits="MM" bufferColor="255,255,255,230" bufferOpacity="1" bufferJoinStyle="128" bufferNoFill="1"/>
        <background shapeDraw="0"/>
        <shadow shadowDraw="0"/>
      </text-style>
      <placement placement="1" polygonPlacementFlags="2" priority="5"/>
      <rendering scaleVisibility="0" scaleMin="0" scaleMax="0" obstacle="0" obstacleFactor="1" displayAll="0" drawLabels="1" upsidedownLabels="0" fontLimitPixelSize="0" mergeLines="0" limitNumLabels="0" minFeatureSize="8"/>
    </settings>
  </labeling>
  <fieldConfiguration>
    <field name="id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="survey_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="survey" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="tunnel_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="element_set" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="scheme" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="version" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="element_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="number" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="name" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="chainage_from" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="AllowNull"/>
            <Option type="int" value="3" name="Precision"/>
            <Option type="QString" value="SpinBox" name="Style"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="chainage_to" configurationFlags="None">
      <editWidget type="Range">
        <config>
          <Option type="Map">
            <Option type="bool" value="true" name="AllowNull"/>
            <Option type="int" value="3" name="Precision"/>
            <Option type="QString" value="SpinBox" name="Style"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="label" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="clock_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="clock_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="inspected_share" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="findings" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="result" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="level" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="levels" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="complete" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="result_text" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="finding_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="why" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
    <field name="remark" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option type="Map">
            <Option type="bool" value="false" name="IsMultiline"/>
            <Option type="bool" value="false" name="UseHtml"/>
          </Option>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" field="id" name="Key"/>
    <alias index="1" field="survey_id" name="Survey key"/>
    <alias index="2" field="survey" name="Survey"/>
    <alias index="3" field="tunnel_id" name="Tunnel key"/>
    <alias index="4" field="element_set" name="Elements"/>
    <alias index="5" field="scheme" name="Scheme"/>
    <alias index="6" field="version" name="Version"/>
    <alias index="7" field="element_id" name="Element key"/>
    <alias index="8" field="number" name="Number"/>
    <alias index="9" field="name" name="Element"/>
    <alias index="10" field="chainage_from" name="Chainage from (m)"/>
    <alias index="11" field="chainage_to" name="Chainage to (m)"/>
    <alias index="12" field="label" name="Middle"/>
    <alias index="13" field="clock_from" name="Clock from (h)"/>
    <alias index="14" field="clock_to" name="Clock to (h)"/>
    <alias index="15" field="inspected_share" name="Inspected share"/>
    <alias index="16" field="findings" name="Findings"/>
    <alias index="17" field="result" name="Result"/>
    <alias index="18" field="level" name="Level, from 1, the best"/>
    <alias index="19" field="levels" name="Number of levels"/>
    <alias index="20" field="complete" name="Inspected in full"/>
    <alias index="21" field="result_text" name="Result in words"/>
    <alias index="22" field="finding_id" name="Deciding finding"/>
    <alias index="23" field="why" name="Why"/>
    <alias index="24" field="remark" name="Not inspected or not known"/>
  </aliases>
  <previewExpression>"name"</previewExpression>
  <mapTip>&lt;b&gt;[% replace("name", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]: [% replace("result_text", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;/b&gt;&lt;br&gt;[% replace("scheme", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %] [% replace("version", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;br&gt;inspected [% format_number(100 * "inspected_share", 1) %] %, findings [% "findings" %][% coalesce('&lt;br&gt;' || replace("why", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')), '') %][% coalesce('&lt;br&gt;' || replace("remark", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')), '') %]</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
